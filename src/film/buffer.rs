//! The film itself: a grid of tiles that are written in parallel and read at any time.

use super::{FilmError, Pass, PassSet, Rect, Sample, Tile};
use rayon::prelude::*;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Side of a tile, pixels.
pub const TILE_SIZE: u32 = 32;

/// Longest side of a film, pixels; Blender's own limit.
const MAX_SIDE: u32 = 65_536;

/// Accumulates samples and gives their means as pictures.
#[derive(Debug)]
pub struct Film {
    width: u32,
    height: u32,
    passes: PassSet,
    /// Tiles per row of tiles.
    tiles_across: u32,
    tiles: Vec<SharedTile>,
}

/// A tile and its lock.
#[derive(Debug)]
pub struct SharedTile {
    rect: Rect,
    tile: Mutex<Tile>,
}

impl SharedTile {
    /// The tile's place on the film.
    pub fn rect(&self) -> Rect {
        self.rect
    }

    /// The tile, to be written to. Its keeper must not wait for other parallel work meanwhile: it could be
    /// handed a task that wants the same tile. One whose writer panicked holds whole samples all the same,
    /// and stays usable.
    pub fn lock(&self) -> MutexGuard<'_, Tile> {
        self.tile.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Film {
    /// A black film of `width` by `height` pixels that keeps `passes`. The sums of radiance and alpha are
    /// always kept, since the error estimate needs them.
    pub fn new(width: u32, height: u32, passes: PassSet) -> Result<Self, FilmError> {
        if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) {
            return Err(FilmError::Size { width, height, max: MAX_SIDE });
        }
        if passes.is_empty() {
            return Err(FilmError::NoPasses);
        }
        let bytes = Self::memory_bytes(width, height, passes);
        let no_memory = || FilmError::Memory { width, height, bytes };
        // Tiles are small, so a system that overcommits would grant them one by one until it breaks down.
        // Asking for all of it at once fails early, and costs nothing where it does not: nothing is touched.
        let mut probe = Vec::<u8>::new();
        probe.try_reserve_exact(usize::try_from(bytes).map_err(|_| no_memory())?).map_err(|_| no_memory())?;
        drop(std::hint::black_box(probe));

        let (across, down) = (width.div_ceil(TILE_SIZE), height.div_ceil(TILE_SIZE));
        let mut tiles = Vec::with_capacity(across as usize * down as usize);
        for (column, row) in Rect::new(0, 0, across, down).pixels() {
            let (x, y) = (column * TILE_SIZE, row * TILE_SIZE);
            let rect = Rect::new(x, y, TILE_SIZE.min(width - x), TILE_SIZE.min(height - y));
            let tile = Tile::new(rect, passes).map_err(|_| no_memory())?;
            tiles.push(SharedTile { rect, tile: Mutex::new(tile) });
        }
        Ok(Self { width, height, passes, tiles_across: across, tiles })
    }

    /// Memory a film of this kind occupies, bytes.
    pub fn memory_bytes(width: u32, height: u32, passes: PassSet) -> u64 {
        (width as u64 * height as u64).saturating_mul(Tile::bytes_per_pixel(passes))
    }

    /// Width, pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height, pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The whole film.
    pub fn rect(&self) -> Rect {
        Rect::new(0, 0, self.width, self.height)
    }

    /// The passes it was asked to keep.
    pub fn passes(&self) -> PassSet {
        self.passes
    }

    /// Every tile once, in parallel and one tile a task, since their costs differ widely.
    pub fn par_tiles(&self) -> impl IndexedParallelIterator<Item = &SharedTile> {
        self.tiles.par_iter().with_max_len(1)
    }

    /// Adds one sample to every pixel, in parallel: for integrators that make whole pictures.
    /// `sample(x, y)` is asked for film pixels.
    pub fn add_iteration(&self, sample: impl Fn(u32, u32) -> Sample + Sync) {
        self.add_to_band(self.rect(), sample);
    }

    /// The film from top to bottom, in bands of whole tiles with at most about so many pixels.
    pub fn bands(&self, most_pixels: u64) -> Vec<Rect> {
        let down = self.height.div_ceil(TILE_SIZE);
        let row_of_tiles = u64::from(TILE_SIZE) * u64::from(self.width);
        let most = (most_pixels / row_of_tiles).clamp(1, u64::from(down)) as u32;
        // all alike
        let rows = down.div_ceil(down.div_ceil(most)) * TILE_SIZE;
        let band = |y: u32| Rect::new(0, y, self.width, rows.min(self.height - y));
        (0..self.height).step_by(rows as usize).map(band).collect()
    }

    /// Adds one sample to every pixel of a band of [`Film::bands`], as [`Film::add_iteration`] does.
    pub fn add_to_band(&self, band: Rect, sample: impl Fn(u32, u32) -> Sample + Sync) {
        let rows = band.y..band.y + band.height;
        self.par_tiles().filter(|shared| rows.contains(&shared.rect().y)).for_each(|shared| {
            let mut tile = shared.lock();
            for (x, y) in shared.rect().pixels() {
                tile.add(x, y, &sample(x, y));
            }
        });
    }

    /// Samples that count so far, over all pixels.
    pub fn total_samples(&self) -> u64 {
        self.tiles.iter().map(|tile| tile.lock().total_count()).sum()
    }

    /// Samples that were left out because they were not finite, or negative beyond rounding.
    pub fn rejected_samples(&self) -> u64 {
        self.tiles.iter().map(|tile| tile.lock().rejected()).sum()
    }

    /// Samples that count so far, for every pixel of `rect`, row by row.
    pub fn sample_counts(&self, rect: Rect) -> Result<Vec<u32>, FilmError> {
        let mut counts = vec![0; self.checked(rect)?.area()];
        self.visit(rect, |tile, pixel, place| counts[place] = tile.count(pixel));
        Ok(counts)
    }

    /// A rectangle of a pass as it stands now: `width * height * channels` floats, row 0 on top, zero where
    /// there are no samples yet. Combined is premultiplied.
    pub fn read_pass(&self, pass: Pass, rect: Rect) -> Result<Vec<f32>, FilmError> {
        let mut out = vec![0.0; self.checked(rect)?.area() * pass.channels()];
        self.read_pass_into(pass, rect, &mut out)?;
        Ok(out)
    }

    /// [`Film::read_pass`] into memory of exactly the right length.
    pub fn read_pass_into(&self, pass: Pass, rect: Rect, out: &mut [f32]) -> Result<(), FilmError> {
        let channels = pass.channels();
        let needed = self.checked(rect)?.area() * channels;
        if !self.passes.contains(pass) {
            return Err(FilmError::MissingPass(pass));
        }
        if out.len() != needed {
            return Err(FilmError::BufferLength { needed, given: out.len() });
        }
        self.visit(rect, |tile, pixel, place| {
            tile.read(pass, pixel, &mut out[place * channels..][..channels]);
        });
        Ok(())
    }

    /// `rect`, if it is a rectangle of this film.
    pub(super) fn checked(&self, rect: Rect) -> Result<Rect, FilmError> {
        let (width, height) = (self.width, self.height);
        if rect.is_inside(width, height) { Ok(rect) } else { Err(FilmError::Rect { rect, width, height }) }
    }

    /// Calls `f(tile, pixel of the tile, pixel of the rectangle)` for every pixel of `rect`, locking one
    /// tile at a time.
    pub(super) fn visit(&self, rect: Rect, mut f: impl FnMut(&Tile, usize, usize)) {
        let last = |start: u32, length: u32| (start + length - 1) / TILE_SIZE;
        for row in rect.y / TILE_SIZE..=last(rect.y, rect.height) {
            for column in rect.x / TILE_SIZE..=last(rect.x, rect.width) {
                let shared = &self.tiles[row as usize * self.tiles_across as usize + column as usize];
                let (place, tile) = (shared.rect(), shared.lock());
                for (x, y) in place.intersection(&rect).into_iter().flat_map(|r| r.pixels()) {
                    f(&tile, place.index(x, y), rect.index(x, y));
                }
            }
        }
    }
}

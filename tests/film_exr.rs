//! EXR files: what was written is what another reader finds.

use exr::prelude::{
    AnyChannels, AttributeValue, FlatSamples, Image, Layer, ReadChannels, ReadLayers, Text, read,
};
use glam::{Mat4, Vec3};
use segue::film::{Compression, ExrOptions, Film, FilmError, FirstHit, Pass, PassSet, Rect, Sample};
use std::io::Cursor;
use std::path::PathBuf;

type Read = Image<Layer<AnyChannels<FlatSamples>>>;

fn decode(bytes: &[u8]) -> Read {
    let reader = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    reader.all_attributes().from_buffered(Cursor::new(bytes)).unwrap()
}

fn channel(image: &Read, name: &str) -> Vec<f32> {
    let list = &image.layer_data.channel_data.list;
    let found = list.iter().find(|c| c.name.to_string() == name);
    found.unwrap_or_else(|| panic!("no channel {name}")).sample_data.values_as_f32().collect()
}

fn names(image: &Read) -> Vec<String> {
    image.layer_data.channel_data.list.iter().map(|c| c.name.to_string()).collect()
}

/// A film whose every value says where it is; the values are exact in 16 bits.
fn film(width: u32, height: u32, passes: PassSet) -> Film {
    let film = Film::new(width, height, passes).unwrap();
    film.add_iteration(|x, y| {
        let v = Vec3::new(x as f32, y as f32, 0.5);
        let hit =
            FirstHit { depth: 1e6 + x as f32, object_index: 70_000 + y, normal: v, ..Default::default() };
        Sample { radiance: v, alpha: 0.25, first_hit: Some(hit), ..Default::default() }
    });
    film
}

/// A directory of this test alone, removed at the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("segue-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.0).unwrap();
        entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).unwrap();
    }
}

#[test]
fn every_pass_is_there_under_its_name_and_in_its_precision() {
    let film = film(70, 66, Pass::ALL.into_iter().collect());
    for (layer, prefix, combined) in [("", "", ""), ("ViewLayer", "ViewLayer.", "ViewLayer.Combined.")] {
        let options = ExrOptions { layer: layer.into(), ..Default::default() };
        let image = decode(&film.exr_bytes(film.rect(), &options).unwrap());
        let mut expected: Vec<String> = "RGBA".chars().map(|c| format!("{combined}{c}")).collect();
        for pass in Pass::ALL.into_iter().filter(|&pass| pass != Pass::Combined) {
            expected.extend(pass.channel_letters().chars().map(|c| format!("{prefix}{}.{c}", pass.name())));
        }
        expected.sort();
        assert_eq!(names(&image), expected);
        for c in &image.layer_data.channel_data.list {
            let name = c.name.to_string();
            let full = ["Depth", "Position", "UV", "ObjectIndex", "MaterialIndex"]
                .iter()
                .any(|pass| name.starts_with(&format!("{prefix}{pass}.")));
            assert_eq!(matches!(c.sample_data, FlatSamples::F32(_)), full, "{name}");
        }
        let depth = channel(&image, &format!("{prefix}Depth.Z"));
        let index = channel(&image, &format!("{prefix}ObjectIndex.X"));
        let green = channel(&image, &format!("{combined}G"));
        let alpha = channel(&image, &format!("{combined}A"));
        let normal = channel(&image, &format!("{prefix}Normal.X"));
        for (x, y) in film.rect().pixels() {
            let i = film.rect().index(x, y);
            let got = [depth[i], index[i], green[i], alpha[i], normal[i]];
            assert_eq!(got, [1e6 + x as f32, (70_000 + y) as f32, y as f32, 0.25, x as f32]);
        }
    }
}

#[test]
fn every_compression_gives_the_pixels_back() {
    let film = film(130, 70, [Pass::Combined, Pass::Depth].into_iter().collect());
    for half in [true, false] {
        for name in ["none", "rle", "zip", "zips", "piz", "pxr24", "dwaa"] {
            let json = format!(r#"{{"half": {half}, "compression": "{name}"}}"#);
            let options: ExrOptions = serde_json::from_str(&json).unwrap();
            let image = decode(&film.exr_bytes(film.rect(), &options).unwrap());
            assert_eq!(image.layer_data.encoding.compression, options.compression.into());
            let tolerance = match options.compression {
                Compression::Dwaa => 0.02,
                Compression::Pxr24 => 1e-4,
                _ => 0.0,
            };
            let (red, depth) = (channel(&image, "R"), channel(&image, "Depth.Z"));
            for (x, y) in film.rect().pixels() {
                let i = film.rect().index(x, y);
                let (r, z) = (x as f32, 1e6 + x as f32);
                assert!(
                    (red[i] - r).abs() <= tolerance * r.max(1.0),
                    "{name}, half {half}: {} for {r}",
                    red[i]
                );
                assert!((depth[i] - z).abs() <= tolerance * z, "{name}, half {half}: {} for {z}", depth[i]);
            }
        }
    }
}

#[test]
fn a_crop_sits_in_its_place_of_the_full_picture() {
    let film = film(50, 40, PassSet::default());
    let options = ExrOptions { full_size: Some([200, 100]), offset: [20, 30], ..Default::default() };
    let image = decode(&film.exr_bytes(Rect::new(3, 4, 10, 12), &options).unwrap());
    let display = image.attributes.display_window;
    assert_eq!((display.position.0, display.position.1), (0, 0));
    assert_eq!((display.size.0, display.size.1), (200, 100));
    let position = image.layer_data.attributes.layer_position;
    assert_eq!((position.0, position.1), (23, 34));
    assert_eq!((image.layer_data.size.0, image.layer_data.size.1), (10, 12));
    let (red, green) = (channel(&image, "R"), channel(&image, "G"));
    assert_eq!((red[0], green[0]), (3.0, 4.0));
    assert_eq!((red[119], green[119]), (12.0, 15.0));

    for (full, offset) in [([60, 100], [20, 30]), ([u32::MAX, 100], [u32::MAX - 50, 30])] {
        let outside = ExrOptions { full_size: Some(full), offset, ..Default::default() };
        assert!(matches!(film.exr_bytes(film.rect(), &outside), Err(FilmError::Window { .. })));
    }
    assert!(matches!(film.exr_bytes(Rect::new(0, 0, 51, 1), &options), Err(FilmError::Rect { .. })));
}

#[test]
fn the_header_says_what_was_asked() {
    let film = film(2, 2, PassSet::default());
    let matrix = Mat4::from_translation(Vec3::new(1.0, 2.0, 3.0)) * Mat4::from_rotation_x(0.5);
    let mut options: ExrOptions =
        serde_json::from_str(r#"{"attributes": {"segue:settings": "{\"seed\": 7}", "artist": "Jörg 画家"}}"#)
            .unwrap();
    options.world_to_camera = Some(matrix);
    let image = decode(&film.exr_bytes(film.rect(), &options).unwrap());
    let attributes = &image.layer_data.attributes;
    let text = |name: &str| match attributes.other.get(&Text::from(name)) {
        Some(AttributeValue::Text(text)) => String::from_utf8(text.as_slice().to_vec()).unwrap(),
        other => panic!("{name}: {other:?}"),
    };
    assert_eq!(text("segue:settings"), r#"{"seed": 7}"#);
    assert_eq!(text("artist"), "Jörg 画家");
    // row vectors: the translation is the last row
    assert_eq!(attributes.world_to_camera.unwrap()[12..15], [1.0, 2.0, 3.0]);
    let primaries = image.attributes.chromaticities.unwrap();
    assert_eq!((primaries.red.0, primaries.white.1), (0.64, 0.3290));
}

#[test]
fn names_the_format_cannot_hold_are_refused() {
    let film = film(2, 2, PassSet::default());
    let long = "x".repeat(300);
    for layer in ["a\0b", &long] {
        let options = ExrOptions { layer: layer.into(), ..Default::default() };
        assert!(matches!(film.exr_bytes(film.rect(), &options), Err(FilmError::ExrText { .. })));
    }
    for name in ["", "a\0b", &long, "worldToCamera"] {
        let attributes = [(name.to_owned(), String::new())].into();
        let options = ExrOptions { attributes, ..Default::default() };
        let error = film.exr_bytes(film.rect(), &options).unwrap_err().to_string();
        assert!(error.contains("OpenEXR"), "{error}");
    }
    assert!(serde_json::from_str::<ExrOptions>(r#"{"compresion": "zip"}"#).is_err());
    assert!(serde_json::from_str::<ExrOptions>(r#"{"compression": "jpeg"}"#).is_err());
}

#[test]
fn names_longer_than_the_old_limit_are_written() {
    let film = film(2, 2, PassSet::default());
    let layer = "a layer with a name of more than thirty-two bytes".to_owned();
    let image = decode(
        &film.exr_bytes(film.rect(), &ExrOptions { layer: layer.clone(), ..Default::default() }).unwrap(),
    );
    assert_eq!(names(&image)[0], format!("{layer}.Combined.A"));
}

#[test]
fn too_bright_for_16_bits_is_the_brightest() {
    let film = Film::new(1, 1, PassSet::default()).unwrap();
    film.add_iteration(|_, _| Sample {
        radiance: Vec3::new(1e9, 65_504.0, 0.0),
        alpha: 1.0,
        ..Default::default()
    });
    let image = decode(&film.exr_bytes(film.rect(), &ExrOptions::default()).unwrap());
    assert_eq!((channel(&image, "R")[0], channel(&image, "G")[0]), (65_504.0, 65_504.0));
    let float = ExrOptions { half: false, ..Default::default() };
    assert_eq!(channel(&decode(&film.exr_bytes(film.rect(), &float).unwrap()), "R")[0], 1e9);
}

#[test]
fn a_file_appears_whole_or_not_at_all() {
    let scratch = Scratch::new("whole");
    let film = film(40, 40, PassSet::default());
    let path = scratch.0.join("Bild ä.exr");
    film.write_exr(&path, &ExrOptions::default()).unwrap();
    film.write_exr(&path, &ExrOptions { half: false, ..Default::default() }).unwrap();
    let image = decode(&std::fs::read(&path).unwrap());
    assert!(matches!(image.layer_data.channel_data.list[0].sample_data, FlatSamples::F32(_)));

    // a refused file leaves the old one, and nothing else
    let bad = ExrOptions { attributes: [("tiles".to_owned(), String::new())].into(), ..Default::default() };
    assert!(matches!(film.write_exr(&path, &bad), Err(FilmError::Encode(_))));
    assert_eq!(decode(&std::fs::read(&path).unwrap()), image);
    assert_eq!(scratch.files(), ["Bild ä.exr"]);
}

#[test]
fn errors_of_the_file_system_name_the_file() {
    let scratch = Scratch::new("errors");
    let film = film(4, 4, PassSet::default());
    for path in [scratch.0.join("missing").join("a.exr"), scratch.0.clone()] {
        let error = film.write_exr(&path, &ExrOptions::default()).unwrap_err();
        assert!(matches!(error, FilmError::Io { .. }));
        assert!(error.to_string().contains(path.to_str().unwrap()), "{error}");
    }
    assert!(film.write_exr("".as_ref(), &ExrOptions::default()).is_err());
    assert!(scratch.files().is_empty());
}

#[test]
#[cfg(unix)]
fn a_link_stays_a_link() {
    let scratch = Scratch::new("link");
    let film = film(4, 4, PassSet::default());
    let (target, link) = (scratch.0.join("target.exr"), scratch.0.join("link.exr"));
    std::fs::write(&target, "old").unwrap();
    std::os::unix::fs::symlink(&target, &link).unwrap();
    film.write_exr(&link, &ExrOptions::default()).unwrap();
    assert!(link.is_symlink());
    decode(&std::fs::read(&target).unwrap());
}

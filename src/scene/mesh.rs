//! Triangle meshes, and how polygons become triangles.

use super::triangulate::Triangulation;
use super::{SceneError, Warnings};
use glam::{Vec2, Vec3, Vec4};

/// Where the values of an attribute sit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// One value.
    Constant,
    /// One a polygon.
    Face,
    /// One a point.
    Vertex,
    /// One a polygon corner.
    Corner,
}

/// An attribute over triangles.
#[derive(Clone, Debug)]
pub enum Attribute<T> {
    /// The same everywhere.
    Constant(T),
    /// One value a triangle.
    Face(Vec<T>),
    /// One value a vertex.
    Vertex(Vec<T>),
    /// Three values a triangle.
    Corner(Vec<[T; 3]>),
}

impl<T: Copy> Attribute<T> {
    /// Values at the corners of a triangle; `None` where one value holds for all of it.
    #[inline]
    pub fn corners(&self, triangle: usize, vertices: [u32; 3]) -> Result<[T; 3], T> {
        match self {
            Self::Constant(v) => Err(*v),
            Self::Face(v) => Err(v[triangle]),
            Self::Vertex(v) => Ok(vertices.map(|i| v[i as usize])),
            Self::Corner(v) => Ok(v[triangle]),
        }
    }
}

/// An attribute as it comes in, by polygons.
#[derive(Clone, Copy, Debug)]
pub struct AttributeInput<'a> {
    /// Its name.
    pub name: &'a str,
    /// `count * components` values.
    pub data: &'a [f32],
    /// 2 for a UV set, 3 or 4 for a colour.
    pub components: usize,
    /// Where the values sit.
    pub interpolation: Interpolation,
    /// Optional: which value belongs to each element.
    pub indices: Option<&'a [u32]>,
}

/// A polygon mesh as it comes in.
#[derive(Clone, Copy, Debug, Default)]
pub struct MeshInput<'a> {
    /// The name, for messages.
    pub name: &'a str,
    /// Object-space positions.
    pub points: &'a [Vec3],
    /// Corners of each polygon; `None`: all are triangles.
    pub face_counts: Option<&'a [u32]>,
    /// Point of each polygon corner.
    pub face_indices: &'a [u32],
    /// Polygons that are not there.
    pub holes: &'a [u32],
    /// Shading normals and where they sit; `None`: flat.
    pub normals: Option<(&'a [Vec3], Interpolation)>,
    /// Material slot of each polygon.
    pub face_slots: Option<&'a [u32]>,
    /// Corners wind clockwise seen from the front.
    pub left_handed: bool,
    /// UV sets and colours.
    pub attributes: &'a [AttributeInput<'a>],
}

/// A validated triangle mesh in object space. Corners wind counter-clockwise seen from the front.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// The name, for messages.
    pub name: String,
    /// Positions; finite where a triangle uses them.
    pub positions: Vec<Vec3>,
    /// Vertex indices; all in range, no triangle is degenerate by its indices.
    pub triangles: Vec<[u32; 3]>,
    /// Shading normals, not normalised; zero or non-finite where there is none.
    pub normals: Option<Attribute<Vec3>>,
    /// UV sets by name.
    pub uvs: Vec<(String, Attribute<Vec2>)>,
    /// Colours by name.
    pub colors: Vec<(String, Attribute<Vec4>)>,
    /// Material slot of each triangle; `None`: all 0.
    pub slots: Option<Vec<u16>>,
}

impl Mesh {
    /// Triangulates and checks a polygon mesh. Wrong sizes and indices are errors; triangles that
    /// cannot be hit (non-finite, zero area) are dropped and counted in `warnings`.
    pub fn new(input: &MeshInput, warnings: &mut Warnings) -> Result<Self, SceneError> {
        let object = format!("mesh {:?}", input.name);
        let fail = |problem: String| SceneError::new(object.clone(), problem);
        if input.points.len() > u32::MAX as usize || input.face_indices.len() > u32::MAX as usize {
            return Err(fail("it has more than 2^32 points or corners".into()));
        }
        if let Some(&i) = input.face_indices.iter().find(|&&i| i as usize >= input.points.len()) {
            return Err(fail(format!("a corner uses point {i}, but there are {}", input.points.len())));
        }
        let face_count = match input.face_counts {
            Some(counts) => {
                let corners: u64 = counts.iter().map(|&c| c as u64).sum();
                if corners != input.face_indices.len() as u64 {
                    let n = input.face_indices.len();
                    return Err(fail(format!("its polygons need {corners} corner indices, there are {n}")));
                }
                counts.len()
            }
            None if !input.face_indices.len().is_multiple_of(3) => {
                return Err(fail(format!(
                    "{} corner indices do not make triangles",
                    input.face_indices.len()
                )));
            }
            None => input.face_indices.len() / 3,
        };
        if let Some(&h) = input.holes.iter().find(|&&h| h as usize >= face_count) {
            return Err(fail(format!("hole {h} is not one of its {face_count} polygons")));
        }

        let mut t = Triangulation::new(input, face_count);
        let dropped = t.drop_degenerate(input);
        for (what, n) in [
            ("degenerate triangles dropped", dropped.1),
            ("triangles with a non-finite vertex dropped", dropped.0),
        ] {
            if n > 0 {
                warnings.add(&object, what, n);
            }
        }
        let sizes =
            Sizes { faces: face_count, points: input.points.len(), corners: input.face_indices.len() };
        let expand = Expander { input, t: &t, sizes };

        let normals = match input.normals {
            Some((n, i)) => Some(expand.values("normals", n, i, None).map_err(fail)?),
            None => None,
        };
        let (mut uvs, mut colors) = (Vec::new(), Vec::new());
        for a in input.attributes {
            let what = format!("attribute {:?}", a.name);
            if a.components == 0 || a.data.len() % a.components != 0 {
                return Err(fail(format!(
                    "{what} has {} floats of {} components",
                    a.data.len(),
                    a.components
                )));
            }
            let chunks = a.data.chunks_exact(a.components);
            match a.components {
                2 => {
                    let v: Vec<Vec2> = chunks.map(Vec2::from_slice).collect();
                    uvs.push((
                        a.name.into(),
                        expand.values(&what, &v, a.interpolation, a.indices).map_err(fail)?,
                    ));
                }
                3 | 4 => {
                    let v: Vec<Vec4> = chunks
                        .map(|c| Vec4::new(c[0], c[1], c[2], c.get(3).copied().unwrap_or(1.0)))
                        .collect();
                    colors.push((
                        a.name.into(),
                        expand.values(&what, &v, a.interpolation, a.indices).map_err(fail)?,
                    ));
                }
                n => return Err(fail(format!("{what} has {n} components, allowed are 2, 3 and 4"))),
            }
        }
        let slots = match input.face_slots {
            None => None,
            Some(s) if s.len() != face_count => {
                return Err(fail(format!("{} material slots for {face_count} polygons", s.len())));
            }
            Some(s) if s.iter().all(|&s| s == 0) => None,
            Some(s) => {
                if let Some(big) = s.iter().find(|&&s| s > u16::MAX as u32) {
                    return Err(fail(format!("material slot {big} is above {}", u16::MAX)));
                }
                Some((0..t.corners.len()).map(|i| s[t.face(i)] as u16).collect())
            }
        };
        let triangles = t.corners.iter().map(|c| c.map(|c| input.face_indices[c as usize])).collect();
        Ok(Self {
            name: input.name.into(),
            positions: input.points.to_vec(),
            triangles,
            normals,
            uvs,
            colors,
            slots,
        })
    }

    /// Index of the UV set `name`; the empty name is the first one.
    pub fn uv_index(&self, name: &str) -> Option<usize> {
        match name {
            "" => (!self.uvs.is_empty()).then_some(0),
            _ => self.uvs.iter().position(|(n, _)| n == name),
        }
    }

    /// Bytes the mesh takes.
    pub fn memory_bytes(&self) -> usize {
        fn size<T>(a: &Attribute<T>) -> usize {
            match a {
                Attribute::Constant(_) => size_of::<T>(),
                Attribute::Face(v) | Attribute::Vertex(v) => size_of_val(&v[..]),
                Attribute::Corner(v) => size_of_val(&v[..]),
            }
        }
        size_of_val(&self.positions[..])
            + size_of_val(&self.triangles[..])
            + self.normals.as_ref().map_or(0, size)
            + self.uvs.iter().map(|(_, a)| size(a)).sum::<usize>()
            + self.colors.iter().map(|(_, a)| size(a)).sum::<usize>()
            + self.slots.as_ref().map_or(0, |s| 2 * s.len())
    }
}

struct Sizes {
    faces: usize,
    points: usize,
    corners: usize,
}

/// Brings attributes from polygons to triangles.
struct Expander<'a> {
    input: &'a MeshInput<'a>,
    t: &'a Triangulation,
    sizes: Sizes,
}

impl Expander<'_> {
    fn values<T: Copy>(
        &self,
        what: &str,
        data: &[T],
        interpolation: Interpolation,
        indices: Option<&[u32]>,
    ) -> Result<Attribute<T>, String> {
        let elements = match interpolation {
            Interpolation::Constant => 1,
            Interpolation::Face => self.sizes.faces,
            Interpolation::Vertex => self.sizes.points,
            Interpolation::Corner => self.sizes.corners,
        };
        let given = indices.map_or(data.len(), <[u32]>::len);
        if given != elements {
            let where_ = format!("{interpolation:?}").to_lowercase();
            return Err(format!("{what}: {given} values for {elements} elements ({where_} interpolation)"));
        }
        if let Some(&i) = indices.and_then(|i| i.iter().find(|&&i| i as usize >= data.len())) {
            return Err(format!("{what}: index {i} is not one of its {} values", data.len()));
        }
        let value = |element: usize| data[indices.map_or(element, |i| i[element] as usize)];
        Ok(match interpolation {
            Interpolation::Constant => Attribute::Constant(value(0)),
            Interpolation::Face => {
                Attribute::Face((0..self.t.corners.len()).map(|i| value(self.t.face(i))).collect())
            }
            Interpolation::Vertex => Attribute::Vertex((0..self.input.points.len()).map(value).collect()),
            Interpolation::Corner => {
                Attribute::Corner(self.t.corners.iter().map(|c| c.map(|c| value(c as usize))).collect())
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(m: &Mesh) -> Vec3 {
        let p = |i: u32| m.positions[i as usize];
        m.triangles.iter().map(|&[a, b, c]| (p(b) - p(a)).cross(p(c) - p(a)) * 0.5).sum()
    }

    fn flat(points: &[[f32; 2]]) -> Vec<Vec3> {
        points.iter().map(|p| Vec3::new(p[0], p[1], 0.0)).collect()
    }

    #[test]
    fn concave_polygons_keep_area_and_winding() {
        // a concave quad (arrow head), an L, and a star-like octagon
        let polygons: [&[[f32; 2]]; 3] = [
            &[[0.0, 0.0], [2.0, -1.0], [0.5, 0.0], [2.0, 1.0]],
            &[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]],
            &[
                [3.0, 0.0],
                [1.0, 1.0],
                [0.0, 3.0],
                [-1.0, 1.0],
                [-3.0, 0.0],
                [-1.0, -1.0],
                [0.0, -3.0],
                [1.0, -1.0],
            ],
        ];
        for (polygon, expected) in polygons.into_iter().zip([0.5, 3.0, 12.0]) {
            for shift in 0..polygon.len() {
                let mut p = polygon.to_vec();
                p.rotate_left(shift);
                let points = flat(&p);
                let indices: Vec<u32> = (0..p.len() as u32).collect();
                for left_handed in [false, true] {
                    let input = MeshInput {
                        points: &points,
                        face_counts: Some(&[p.len() as u32]),
                        face_indices: &indices,
                        left_handed,
                        ..Default::default()
                    };
                    let m = Mesh::new(&input, &mut Warnings::default()).unwrap();
                    assert_eq!(m.triangles.len(), p.len() - 2);
                    let sign = if left_handed { -1.0 } else { 1.0 };
                    approx::assert_relative_eq!(area(&m).z, sign * expected, max_relative = 1e-5);
                    // no triangle is turned over
                    let p = |i: u32| m.positions[i as usize];
                    assert!(
                        m.triangles.iter().all(|&[a, b, c]| sign * (p(b) - p(a)).cross(p(c) - p(a)).z > 0.0)
                    );
                }
            }
        }
    }

    #[test]
    fn attributes_follow_their_polygons() {
        let points = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [2.0, 0.0], [2.0, 1.0]]);
        let uv: Vec<f32> = (0..7).flat_map(|i| [i as f32, -(i as f32)]).collect();
        let color = [0.5, 0.6, 0.7, 0.1, 0.2, 0.3];
        let input = MeshInput {
            points: &points,
            face_counts: Some(&[4, 3]),
            face_indices: &[0, 1, 2, 3, 1, 4, 5],
            face_slots: Some(&[2, 7]),
            attributes: &[
                AttributeInput {
                    name: "st",
                    data: &uv,
                    components: 2,
                    interpolation: Interpolation::Corner,
                    indices: None,
                },
                AttributeInput {
                    name: "paint",
                    data: &color,
                    components: 3,
                    interpolation: Interpolation::Face,
                    indices: Some(&[1, 0]),
                },
            ],
            ..Default::default()
        };
        let m = Mesh::new(&input, &mut Warnings::default()).unwrap();
        assert_eq!(m.triangles, [[0, 1, 2], [0, 2, 3], [1, 4, 5]]);
        assert_eq!(m.slots, Some(vec![2, 2, 7]));
        let Attribute::Corner(uv) = &m.uvs[0].1 else { panic!("not by corner") };
        assert_eq!(uv[1].map(|v| v.x), [0.0, 2.0, 3.0]);
        assert_eq!(uv[2].map(|v| v.x), [4.0, 5.0, 6.0]);
        let Attribute::Face(c) = &m.colors[0].1 else { panic!("not by face") };
        assert_eq!([c[0].x, c[1].x, c[2].x], [0.1, 0.1, 0.5]);
        assert_eq!((m.uv_index("st"), m.uv_index(""), m.uv_index("x")), (Some(0), Some(0), None));
    }

    #[test]
    fn holes_and_degenerate_triangles_are_left_out() {
        let mut points = flat(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        points.push(Vec3::NAN);
        let input = MeshInput {
            points: &points,
            face_indices: &[0, 1, 2, 0, 0, 1, 0, 1, 3, 0, 2, 1],
            holes: &[3],
            face_slots: Some(&[1, 2, 3, 4]),
            ..Default::default()
        };
        let mut w = Warnings::default();
        let m = Mesh::new(&input, &mut w).unwrap();
        assert_eq!((m.triangles.clone(), m.slots.clone()), (vec![[0, 1, 2]], Some(vec![1])));
        assert_eq!(w.lines().len(), 2, "{:?}", w.lines());
    }

    #[test]
    fn wrong_sizes_are_errors_that_name_the_mesh() {
        let points = flat(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        let good =
            MeshInput { name: "chair", points: &points, face_indices: &[0, 1, 2], ..Default::default() };
        let normal = [Vec3::Z; 2];
        let uv = |interpolation, indices| AttributeInput {
            name: "st",
            data: &[0.0; 4],
            components: 2,
            interpolation,
            indices,
        };
        let attributes = [[uv(Interpolation::Vertex, None)], [uv(Interpolation::Vertex, Some(&[0, 1, 2]))]];
        for (bad, what) in [
            (MeshInput { face_indices: &[0, 1, 3], ..good }, "point 3"),
            (MeshInput { face_indices: &[0, 1], ..good }, "triangles"),
            (MeshInput { face_counts: Some(&[4]), ..good }, "4 corner"),
            (MeshInput { holes: &[1], ..good }, "hole 1"),
            (
                MeshInput { normals: Some((&normal, Interpolation::Vertex)), ..good },
                "normals: 2 values for 3",
            ),
            (MeshInput { face_slots: Some(&[0, 1]), ..good }, "slots"),
            (MeshInput { attributes: &attributes[0], ..good }, "\"st\": 2 values"),
            (MeshInput { attributes: &attributes[1], ..good }, "index 2"),
        ] {
            let e = Mesh::new(&bad, &mut Warnings::default()).unwrap_err().to_string();
            assert!(e.contains("mesh \"chair\"") && e.contains(what), "{e}");
        }
        assert!(Mesh::new(&good, &mut Warnings::default()).is_ok());
    }
}

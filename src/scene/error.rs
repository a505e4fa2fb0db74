//! What is wrong with a scene: errors that stop it, and warnings that are counted.

use std::collections::BTreeMap;

/// Something that makes the scene unusable; names the object and what is wrong with it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{object}: {problem}")]
pub struct SceneError {
    /// Kind and name of the object, such as `mesh "floor"`.
    pub object: String,
    /// What is wrong with it.
    pub problem: String,
}

impl SceneError {
    /// An error of `object`.
    pub fn new(object: impl Into<String>, problem: impl Into<String>) -> Self {
        Self { object: object.into(), problem: problem.into() }
    }
}

/// Problems that were repaired or worked around, counted by kind.
#[derive(Clone, Debug, Default)]
pub struct Warnings {
    kinds: BTreeMap<String, Kind>,
}

#[derive(Clone, Debug)]
struct Kind {
    count: u64,
    objects: u64,
    first: String,
}

impl Warnings {
    /// Notes `count` occurrences of `problem` on `object`.
    pub fn add(&mut self, object: impl Into<String>, problem: impl Into<String>, count: u64) {
        let kind = self.kinds.entry(problem.into()).or_insert_with(|| Kind {
            count: 0,
            objects: 0,
            first: object.into(),
        });
        kind.count += count;
        kind.objects += 1;
    }

    /// Takes over another list.
    pub fn merge(&mut self, other: &Warnings) {
        for (problem, kind) in &other.kinds {
            let mine = self.kinds.entry(problem.clone()).or_insert(Kind {
                count: 0,
                objects: 0,
                first: kind.first.clone(),
            });
            mine.count += kind.count;
            mine.objects += kind.objects;
        }
    }

    /// One line a kind of problem, in alphabetical order.
    pub fn lines(&self) -> Vec<String> {
        self.kinds
            .iter()
            .map(|(problem, k)| {
                let times = if k.count > 1 { format!(" ({} times)", k.count) } else { String::new() };
                let others = match k.objects {
                    1 => String::new(),
                    2 => " and 1 other object".to_string(),
                    n => format!(" and {} other objects", n - 1),
                };
                format!("{}{others}: {problem}{times}", k.first)
            })
            .collect()
    }

    /// Whether nothing was noted.
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warnings_are_counted_by_kind() {
        let mut w = Warnings::default();
        w.add("mesh \"a\"", "degenerate triangles dropped", 3);
        w.add("mesh \"b\"", "degenerate triangles dropped", 4);
        w.add("mesh \"b\"", "a non-finite normal replaced", 1);
        assert_eq!(
            w.lines(),
            [
                "mesh \"b\": a non-finite normal replaced",
                "mesh \"a\" and 1 other object: degenerate triangles dropped (7 times)"
            ]
        );
        let mut v = w.clone();
        v.merge(&w);
        assert!(v.lines()[1].ends_with("(14 times)"));
    }
}

//! The decoder's description of a feature grid, as a checkpoint holds it.

use pocketsplat_format::context::GridFrame;
use serde::{Deserialize, Serialize};

/// The fields of a [`GridFrame`].
#[derive(Serialize, Deserialize)]
#[serde(remote = "GridFrame")]
pub(crate) struct Frame {
    min: [i32; 3],
    scale: [u32; 3],
}

/// Levels as kind, resolution and number of rows.
pub(crate) mod levels {
    use pocketsplat_format::context::{GridLevel, LevelKind};
    use serde::de::Error as _;
    use serde::{Deserialize as _, Deserializer, Serialize as _, Serializer};

    type Record = (u8, u16, u32);

    pub(crate) fn serialize<S: Serializer>(levels: &[GridLevel], to: S) -> Result<S::Ok, S::Error> {
        levels.iter().map(|l| (l.kind.code(), l.resolution, l.n_rows)).collect::<Vec<Record>>().serialize(to)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<GridLevel>, D::Error> {
        let level = |(code, resolution, n_rows): Record| {
            let kind = LevelKind::from_code(code)?;
            Some(GridLevel { kind, resolution, n_rows })
        };
        let records = Vec::<Record>::deserialize(from)?;
        let levels: Option<_> = records.into_iter().map(level).collect();
        levels.ok_or_else(|| D::Error::custom("unknown kind of a grid level"))
    }
}

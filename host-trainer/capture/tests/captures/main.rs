//! Captures on disk, through the public interface: sound ones of every layout, broken ones with the message each must
//! give, and real ones where they are at hand.

mod broken;
mod cases;
mod damaged;
mod exports;
mod fixture;
mod made_points;
mod real;
mod remedies;
mod scene;
mod sound;
mod storage;

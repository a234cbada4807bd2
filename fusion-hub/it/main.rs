//! Tests of the pure engine at its boundary: frames in, fused frames out.

mod abuse;
mod arrival_order;
mod consistency;
mod contributors;
mod crowds;
mod detectors;
mod diagnosis;
mod false_alarms;
mod faults;
mod first_frames;
mod fuzz_corpus;
mod lag;
mod late_data;
mod life_of_a_track;
mod methods;
mod numerics;
mod overload;
mod particles;
mod promises;
mod registration;
mod same_instant;
mod saved_state;
mod sizes;
mod smoothing;
mod switches;
mod world;

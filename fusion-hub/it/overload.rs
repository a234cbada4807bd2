//! More frames than the store holds: history gets shorter, with a named refusal.

use crate::world::{agent, at, detection, engine, frame};
use v2x_fusion_hub::engine::MAX_FRAMES;
use v2x_fusion_hub::engine::{Disposition, Refusal};

#[test]
fn a_full_frame_store_shortens_the_history_and_refuses_late_frames_by_name() {
    let mut engine = engine();
    let per_agent = 4000;
    let n_agents = MAX_FRAMES / per_agent + 1;
    let ms = |number: usize| i64::try_from(number * 200 / per_agent).expect("test input");
    let mut accepted = 0;
    for number in 0..per_agent {
        for name in 0..n_agents {
            let captured_ms = ms(number);
            // One object is there all the time; most frames are empty.
            let detections =
                if number % 400 == 0 { vec![detection(0, at(captured_ms), (0.0, 0.0))] } else { vec![] };
            let sent = frame(agent(&format!("a{name}")), number as u64, captured_ms, detections);
            let disposition = engine.handle_frame(&sent, at(captured_ms));
            accepted += usize::from(matches!(disposition, Disposition::Accepted { .. }));
        }
    }
    assert_eq!(accepted, per_agent * n_agents, "new frames are always accepted");
    let now_ms = ms(per_agent - 1);
    let late = |captured_ms| frame(agent("late"), captured_ms as u64, captured_ms, vec![]);
    let refused = engine.handle_frame(&late(1), at(now_ms));
    assert!(matches!(refused, Disposition::Refused(Refusal::Overloaded { .. })), "{refused:?}");
    let recent = engine.handle_frame(&late(now_ms - 1), at(now_ms));
    assert!(matches!(recent, Disposition::Accepted { .. }), "{recent:?}");
    assert_eq!(
        engine.agents().record(&agent("late")).map(|record| record.statistics.refused["overloaded"]),
        Some(1)
    );
    assert_eq!(engine.fused(at(now_ms)).objects.len(), 1, "and the object is still one");
}

//! Score thresholds by recall.

/// Recalls that AMOTA is a mean over.
pub(super) const N_RECALLS: usize = 40;
/// The lowest of them. Figures at lower recalls are noisy.
const MIN_RECALL: f64 = 0.1;

/// The recalls: from 0.1 to 1 in equal steps, to twelve digits.
#[expect(clippy::cast_precision_loss, reason = "40 recalls")]
fn recall(place: usize) -> f64 {
    let step = (1.0 - MIN_RECALL) / (N_RECALLS - 1) as f64;
    libm::rint((MIN_RECALL + step * place as f64) * 1e12) / 1e12
}

/// For each recall, highest first, the score threshold; `None` if the recall is not achieved. `scores` are those of
/// matched boxes, `objects` is the number of true ones.
#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
pub(super) fn score_thresholds(mut scores: Vec<f64>, objects: u64) -> [Option<f64>; N_RECALLS] {
    scores.sort_unstable_by(|a, b| b.total_cmp(a));
    // With the first k + 1 boxes.
    let achieved = |k: usize| (k + 1) as f64 / objects as f64;
    std::array::from_fn(|place| {
        let recall = recall(N_RECALLS - 1 - place);
        let last = scores.len().checked_sub(1)?;
        if recall > achieved(last) {
            return None;
        }
        // The first one with a higher recall: the threshold is between that one and the one before.
        let mut after = (recall * objects as f64) as usize;
        while after > 0 && achieved(after - 1) > recall {
            after -= 1;
        }
        while after <= last && achieved(after) <= recall {
            after += 1;
        }
        if after == 0 {
            return Some(scores[0]);
        }
        let (before, from) = (scores[after - 1], achieved(after - 1));
        // Interpolated as in numpy, so that equal scores give exactly that score.
        Some(if after > last || from == recall {
            before
        } else {
            (scores[after] - before) / (achieved(after) - from) * (recall - from) + before
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recalls_go_from_1_down_to_a_tenth() {
        assert_eq!((recall(0), recall(N_RECALLS - 1)), (0.1, 1.0));
        assert!((recall(13) - 0.4).abs() < 1e-12);
    }

    #[test]
    fn the_threshold_of_a_recall_is_the_score_of_the_box_that_reaches_it() {
        // Ten objects, all matched, with scores 1, 0.9, … 0.1.
        let scores = (1..=10).map(|k| f64::from(k) / 10.0).collect();
        let thresholds = score_thresholds(scores, 10);
        assert!((thresholds[0].unwrap() - 0.1).abs() < 1e-12);
        assert!((thresholds[N_RECALLS - 1].unwrap() - 1.0).abs() < 1e-12);
        assert!((thresholds[N_RECALLS - 1 - 13].unwrap() - 0.7).abs() < 1e-9, "recall 0.4");
        assert!(thresholds.is_sorted());
    }

    #[test]
    fn recalls_beyond_what_is_matched_have_no_threshold() {
        let thresholds = score_thresholds(vec![0.5; 4], 10);
        assert_eq!(thresholds.iter().flatten().count(), 14, "0.1 to 0.4");
        assert!(thresholds.iter().flatten().all(|threshold| *threshold == 0.5));
        assert_eq!(score_thresholds(vec![], 10), [None; N_RECALLS]);
    }
}

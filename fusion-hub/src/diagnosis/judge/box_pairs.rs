//! Two agents say that the same vehicles are of different sizes.

use super::super::finding::{Code, Finding, Severity};
use super::super::window::{Source, Window};
use v2x_common::id::AgentId;

/// Widths and depths of the same vehicles differ by such a factor, and by nearly the same one, where one of two agents is wrong. Margins, and
/// who sees the near sides of vehicles, make less, or change one more than the other.
const TOGETHER: f64 = 1.25;
const ALIKE: f64 = 1.15;
/// Who differs by less than this agrees.
const AGREES: f64 = 1.1;

/// Findings of pairs of agents, of whom nothing is known of their sizes alone (`is_known`).
pub(super) fn findings(window: &Window, source: Source, is_known: impl Fn(&AgentId) -> bool) -> Vec<Finding> {
    let of = |agent: AgentId| window.sizes.iter().filter(move |(pair, _)| pair.contains(&agent));
    let votes = |agent: AgentId| {
        let differs = of(agent).filter(|(_, ratio)| differ(ratio.factors)).count();
        let agrees = of(agent).any(|(_, ratio)| together(ratio.factors).abs() < libm::log(AGREES));
        10 * differs + 1 - usize::from(agrees)
    };
    let (mut findings, mut reported) = (Vec::new(), Vec::new());
    for (pair, ratio) in &window.sizes {
        if !differ(ratio.factors) || pair.iter().any(&is_known) {
            continue;
        }
        let [first, second] = pair.map(votes);
        let whose = usize::from(first <= second);
        let (agent, other) = (pair[whose], pair[1 - whose]);
        if reported.contains(&agent) {
            continue;
        }
        reported.push(agent);
        let factors = ratio.factors.map(|factor| if whose == 1 { factor } else { 1.0 / factor });
        let [own_m, other_m] = [ratio.mean_m[whose], ratio.mean_m[1 - whose]];
        let says = format!(
            "the vehicles of {agent} are {:.2} times as wide and {:.2} times as long as the same ones are by {other} ({} of both: {:.2} m × \
             {:.2} m and {:.2} m × {:.2} m in the mean)",
            factors[0], factors[1], ratio.n, own_m[0], own_m[1], other_m[0], other_m[1]
        );
        let change = format!(
            "{} the whole width and length in metres; where they are not known, {}. Which of both is right, a vehicle of known size \
             shows",
            source.words("Send `w` and `d`:", "Write in the columns w and d"),
            source.words("leave both out", "leave both empty")
        );
        let agent = (first != second).then_some(agent);
        findings.push(Finding { code: Code::Sizes, severity: Severity::Fault, agent, says, change });
    }
    findings
}

/// The logarithm of both factors together.
fn together(factors: [f64; 2]) -> f64 {
    0.5 * (libm::log(factors[0]) + libm::log(factors[1]))
}

fn differ(factors: [f64; 2]) -> bool {
    let [w, d] = factors.map(libm::log);
    (w - d).abs() <= libm::log(ALIKE) && together(factors).abs() >= libm::log(TOGETHER)
}

#[cfg(test)]
mod tests {
    use super::super::super::alignment::sizes::Ratio;
    use super::*;

    fn names<const N: usize>() -> [AgentId; N] {
        std::array::from_fn(|n| AgentId::new(&format!("a{n}")).unwrap())
    }

    fn said(ratios: &[([usize; 2], [f64; 2])]) -> Vec<Finding> {
        let names = names::<3>();
        let mut window = Window::default();
        for (pair, factors) in ratios {
            let ratio = Ratio { factors: *factors, mean_m: [[1.8, 4.5], [2.3, 5.8]], n: 50 };
            window.sizes.insert(pair.map(|n| names[n]), ratio);
        }
        findings(&window, Source::Network, |_| false)
    }

    #[test]
    fn sizes_of_the_same_vehicles_that_differ_by_a_factor_are_found_and_a_third_agent_says_whose() {
        let undecided = said(&[([0, 1], [1.3, 1.3])]);
        assert_eq!(undecided.len(), 1);
        assert!(undecided[0].agent.is_none() && undecided[0].is_fault(), "{}", undecided[0]);
        assert!(undecided[0].says.contains("1.30 times as wide"), "{}", undecided[0]);
        let voted = said(&[([0, 1], [1.3, 1.3]), ([0, 2], [1.0, 1.0]), ([1, 2], [0.77, 0.77])]);
        assert_eq!(voted.len(), 1, "{voted:?}");
        assert_eq!(voted[0].agent, Some(names::<3>()[1]), "{}", voted[0]);
    }

    #[test]
    fn sizes_as_detectors_differ_are_no_finding() {
        // The near sides only; a length that is hard to see; one that is wider and shorter.
        for factors in
            [[1.15, 1.12], [1.0, 1.4], [1.3, 0.8], [0.9, 0.87], [1.2, 1.2], [0.8, 0.6], [1.35, 1.8]]
        {
            assert_eq!(said(&[([0, 1], factors)]), [], "{factors:?}");
        }
        let window = Window {
            sizes: [(names::<2>(), Ratio { factors: [1.3; 2], mean_m: [[1.0; 2]; 2], n: 50 })].into(),
            ..Window::default()
        };
        assert_eq!(findings(&window, Source::Network, |_| true), [], "said of one of both already");
    }
}

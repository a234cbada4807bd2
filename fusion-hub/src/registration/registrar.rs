//! Registration from end to end: descriptions and shared objects in, corrections out.

use super::decision::Belief;
use super::group::Group;
use super::joint::Joint;
use super::links::Links;
use super::model::{Bias, Difference, SharedObject, Source, joined};
use super::registered::RegisteredAgent;
use super::report::AgentRegistration;
use super::settings::Registration;
use super::slot::{MAX_REGISTERED, RegistrationSlot};
use super::whiteness::Shown;
use crate::values::PoseErrors;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use v2x_common::detection::DetectionFrame;
use v2x_common::id::AgentId;
use v2x_common::sensor::Accuracy;
use v2x_common::time::{Span, Timestamp};

/// The gathered information is applied this often.
const STEP: Span = Span::from_millis(500);
/// An agent that was silent for this long makes room for another one: its estimate has decayed.
const SILENT_FOR_GOOD: Span = Span::from_millis(180_000);

/// One that has shared no objects with others for this long makes room, too: there is no estimate.
const SHARES_WITHIN: Span = Span::from_millis(10_000);
/// Agents without a place that are remembered, at most.
const MAX_LEFT_OUT: usize = 64;
/// For so long after they were heard.
const LEFT_OUT_FOR: Span = Span::from_millis(10_000);

/// Estimates the clock and pose errors of all agents that describe their accuracy.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Registrar {
    mode: Registration,
    /// By slot.
    registered: Vec<RegisteredAgent>,
    joint: Joint,
    links: Links,
    reached: [bool; MAX_REGISTERED],
    advanced_at: Option<Timestamp>,
    n_dropped: u64,
    /// Agents for which there is no place: what they declare, and when they were heard last.
    left_out: BTreeMap<AgentId, (Accuracy, Timestamp)>,
}

impl Registrar {
    /// Without agents.
    pub fn new(mode: Registration) -> Self {
        Self { mode, ..Self::default() }
    }

    /// Takes in what an agent declares of its accuracy, at `now` by the hub's clock. Beyond [`MAX_REGISTERED`] agents
    /// those that share no objects with others give way, and the last ones are not estimated.
    pub fn describe(&mut self, agent: AgentId, accuracy: Accuracy, now: Timestamp) {
        if self.mode == Registration::Off {
            return;
        }
        let newcomer = RegisteredAgent::new(agent, accuracy, now);
        if let Some(slot) = self.slot_of(agent) {
            self.redescribe(slot, accuracy, now);
        } else if let Some(slot) = self.vacant() {
            self.registered.push(newcomer);
            self.joint.grow();
            self.links.forget(slot);
        } else if let Some(slot) = self.silent_for_good(now) {
            self.replace(slot, newcomer);
        } else if let Some(slot) = self.shares_nothing(now) {
            let RegisteredAgent { agent, accuracy, heard_at, .. } = self.registered[slot.index()];
            self.replace(slot, newcomer);
            self.leave_out(agent, accuracy, heard_at);
        } else {
            self.leave_out(agent, accuracy, now);
        }
    }

    fn leave_out(&mut self, agent: AgentId, accuracy: Accuracy, heard_at: Timestamp) {
        self.left_out.retain(|_, (_, at)| heard_at - *at < LEFT_OUT_FOR);
        if self.left_out.len() < MAX_LEFT_OUT || self.left_out.contains_key(&agent) {
            self.left_out.insert(agent, (accuracy, heard_at));
        }
    }

    /// Agents that were heard lately, of which the errors are not estimated for want of a place.
    pub fn left_out(&self, now: Timestamp) -> impl Iterator<Item = AgentId> {
        let lately = self.left_out.iter().filter(move |(_, (_, at))| now - *at < LEFT_OUT_FOR);
        lately.map(|(agent, _)| *agent)
    }

    /// An agent declares another accuracy: what is known of its errors stays, in the new units.
    fn redescribe(&mut self, slot: RegistrationSlot, accuracy: Accuracy, now: Timestamp) {
        let registered = &mut self.registered[slot.index()];
        registered.heard_at = now;
        let before = registered.sigmas();
        registered.accuracy = accuracy;
        let after = registered.sigmas();
        // Nothing is known in units of zero.
        let ratio = |k: usize| (before[k] > 0.0 && after[k] > 0.0).then(|| before[k] / after[k]);
        let ratios = [0, 1, 2, 3].map(ratio);
        if ratios != [Some(1.0); 4] {
            registered.applied = registered.applied.limited(&after);
            registered.whiteness.rescale(ratios[0]);
            self.joint.rescale(slot, &ratios);
        }
    }

    fn vacant(&self) -> Option<RegistrationSlot> {
        let place = u8::try_from(self.registered.len()).ok()?;
        (usize::from(place) < MAX_REGISTERED).then_some(RegistrationSlot(place))
    }

    fn silent_for_good(&self, now: Timestamp) -> Option<RegistrationSlot> {
        let slots = (0..).map(RegistrationSlot).zip(&self.registered);
        let (slot, silent) = slots.min_by_key(|(_, registered)| registered.heard_at)?;
        (now - silent.heard_at > SILENT_FOR_GOOD).then_some(slot)
    }

    /// Of those that share no objects with others the one that was heard least lately.
    fn shares_nothing(&self, now: Timestamp) -> Option<RegistrationSlot> {
        let slots = (0..).map(RegistrationSlot).zip(&self.registered);
        let slots =
            slots.filter(|(slot, one)| now - one.since >= SHARES_WITHIN && !self.links.is_joined(*slot));
        slots.min_by_key(|(_, one)| one.heard_at).map(|(slot, _)| slot)
    }

    fn replace(&mut self, slot: RegistrationSlot, newcomer: RegisteredAgent) {
        self.left_out.remove(&newcomer.agent);
        self.registered[slot.index()] = newcomer;
        self.joint.forget(slot);
        self.links.forget(slot);
    }

    fn slot_of(&self, agent: AgentId) -> Option<RegistrationSlot> {
        (0..)
            .map(RegistrationSlot)
            .zip(&self.registered)
            .find(|(_, registered)| registered.agent == agent)
            .map(|(slot, _)| slot)
    }

    /// The agent of a frame that arrived at `now`, and the correction of the frame. `None` where the agent is not
    /// estimated, where the frame has no sensor pose, or where all agents are references.
    pub fn source_of(&mut self, frame: &DetectionFrame, now: Timestamp) -> Option<Source> {
        let pose = frame.sensor_pose?;
        let agent = frame.id.agent;
        if let Some(&(accuracy, _)) = self.left_out.get(&agent) {
            self.describe(agent, accuracy, now);
        }
        let slot = self.slot_of(agent)?;
        if self.registered.iter().all(RegisteredAgent::is_reference) {
            self.registered[slot.index()].heard_at = now;
            return None;
        }
        let registered = &mut self.registered[slot.index()];
        registered.heard_at = now;
        let applied = registered.applied;
        let sensor = [pose.x - applied.dx_m, pose.y - applied.dy_m];
        Some(Source { slot, is_reference: registered.is_reference(), sensor, applied })
    }

    /// What is unknown of an agent's pose: what it declares, or where its frames may be corrected, what is left. `None` of an
    /// agent that declares nothing.
    pub fn pose_errors(&self, agent: AgentId) -> Option<PoseErrors> {
        let slot = self.slot_of(agent)?;
        let registered = &self.registered[slot.index()];
        let is_measured = self.reached[slot.index()] && !registered.is_reference();
        if !is_measured || self.mode != Registration::Correct {
            return Some(PoseErrors::declared(&registered.accuracy));
        }
        let Belief { mean, covariance } = belief(&self.joint, slot);
        let (sigmas, applied) = (registered.sigmas(), registered.applied.to_array());
        let white = registered.whiteness.kappa();
        let left = |k: usize| {
            let uncorrected = mean[k] * sigmas[k] - applied[k];
            (covariance[k][k] + white) * sigmas[k] * sigmas[k] + uncorrected * uncorrected
        };
        Some(PoseErrors { position: (left(0) + left(1)) / 2.0, yaw: left(2) })
    }

    /// Takes in the objects of one frame that other agents detect, too.
    pub fn observe(&mut self, shared: &[SharedObject]) {
        let mut met = [false; MAX_REGISTERED];
        for one in shared {
            let partner = one.partner.source.slot;
            if !std::mem::replace(&mut met[partner.index()], true) {
                let same = shared.iter().filter(|other| other.partner.source.slot == partner);
                self.observe_with((one.own.source.slot, partner), same);
            }
        }
    }

    fn observe_with<'a>(
        &mut self,
        (own, partner): (RegistrationSlot, RegistrationSlot),
        shared: impl Iterator<Item = &'a SharedObject>,
    ) {
        let [own_sigmas, partner_sigmas] = [own, partner].map(|slot| self.registered[slot.index()].sigmas());
        let sigmas = joined(own_sigmas, partner_sigmas);
        let white = self.white(own, partner);
        let believed = self.joint.pair(own, partner);
        let clocks = [0.0, 0.0, 0.0, sigmas[3], 0.0, 0.0, 0.0, -sigmas[7]];
        let apart = super::model::dot(&clocks, &believed.mean);
        let clock_variance = believed.spread(&clocks, &clocks, &[0.0; 8]) + apart * apart;
        let mut group = Group::EMPTY;
        for one in shared {
            group.add(&Difference::of(one, &sigmas, clock_variance), &believed, &white);
        }
        let shown = Shown::by(&group, &believed);
        self.joint.gather(own, partner, &group.without_white(&white));
        self.links.note(own, partner, group.count);
        for slot in [own, partner] {
            let registered = &mut self.registered[slot.index()];
            registered.whiteness.note(shown);
            registered.pairs += u64::from(group.count);
        }
    }

    fn white(&self, own: RegistrationSlot, partner: RegistrationSlot) -> [f64; 8] {
        let [own, partner] = [own, partner].map(|slot| self.registered[slot.index()].whiteness.kappa());
        joined([own; 4], [partner; 4])
    }

    /// Applies the gathered information, twice a second, and decides the corrections from then on. A time before the
    /// newest one changes nothing.
    pub fn advance(&mut self, now: Timestamp) {
        let before = *self.advanced_at.get_or_insert(now);
        if now - before < STEP || self.registered.is_empty() {
            return;
        }
        self.advanced_at = Some(now);
        let dt_s = (now - before).as_secs_f64();
        self.n_dropped += u64::from(self.joint.advance(dt_s).is_err());
        self.links.fade(dt_s);
        let references =
            (0..).map(RegistrationSlot).zip(&self.registered).filter(|(_, one)| one.is_reference());
        self.reached = self.links.reached_from(references.map(|(slot, _)| slot));
        for (slot, registered) in (0..).map(RegistrationSlot).zip(&mut self.registered) {
            registered.whiteness.fade(dt_s);
            let believed = belief(&self.joint, slot);
            let is_measured = self.reached[slot.index()] && !registered.is_reference();
            let allowed = is_measured && self.mode == Registration::Correct;
            let (decision, taken) = registered.decision.next(&believed, allowed);
            registered.decision = decision;
            let sigmas = registered.sigmas();
            registered.applied = Bias::from_array([0, 1, 2, 3].map(|k| taken[k] * sigmas[k]));
        }
    }

    /// The estimate of every agent, in the order in which they were described first.
    pub fn report(&self) -> impl Iterator<Item = AgentRegistration> {
        (0..)
            .map(RegistrationSlot)
            .zip(&self.registered)
            .map(|(slot, registered)| self.report_on(slot, registered))
    }

    fn report_on(&self, slot: RegistrationSlot, registered: &RegisteredAgent) -> AgentRegistration {
        let Belief { mean, covariance } = belief(&self.joint, slot);
        let sigmas = registered.sigmas();
        let each = [0, 1, 2, 3];
        let covariance =
            each.map(|row| each.map(|column| sigmas[row] * covariance[row][column] * sigmas[column]));
        AgentRegistration {
            agent: registered.agent,
            bias: Bias::from_array(each.map(|k| mean[k] * sigmas[k])),
            sigma: Bias::from_array(each.map(|k| libm::sqrt(covariance[k][k]))),
            covariance,
            applied: registered.applied,
            observable: registered.decision.observable,
            confounded: registered.decision.confounded,
            is_reference: registered.is_reference(),
            relative_only: self.links.is_joined(slot) && !self.reached[slot.index()],
            exceeds_declared: registered.decision.exceeds_declared,
            white_share: registered.whiteness.kappa(),
            pairs: registered.pairs,
        }
    }

    /// How many times gathered information was dropped because it was not positive definite.
    pub fn n_dropped(&self) -> u64 {
        self.n_dropped
    }
}

fn belief(joint: &Joint, slot: RegistrationSlot) -> Belief {
    Belief { mean: joint.mean_of(slot), covariance: joint.covariance_of(slot, slot) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::geometry::Pose;
    use v2x_common::id::FrameId;

    const VEHICLE: Accuracy = Accuracy { position_m: 0.5, yaw_rad: 0.01, clock_s: 0.05 };

    fn name(k: usize) -> AgentId {
        AgentId::new(&format!("a{k}")).unwrap()
    }

    fn at(seconds: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(1000 * seconds)
    }

    fn is_known(registrar: &mut Registrar, k: usize, now: Timestamp) -> bool {
        let id = FrameId { agent: name(k), epoch: 1, sequence: 1 };
        let frame = DetectionFrame { sensor_pose: Some(Pose::default()), ..DetectionFrame::empty(id, now) };
        registrar.source_of(&frame, now).is_some()
    }

    #[test]
    fn beyond_the_limit_a_newcomer_waits_until_somebody_was_silent_for_good() {
        let mut registrar = Registrar::new(Registration::Correct);
        (0..=MAX_REGISTERED).for_each(|k| registrar.describe(name(k), VEHICLE, at(0)));
        assert!(!is_known(&mut registrar, MAX_REGISTERED, at(1)));
        for k in (0..MAX_REGISTERED).filter(|k| *k != 7) {
            assert!(is_known(&mut registrar, k, at(100)));
        }
        registrar.describe(name(MAX_REGISTERED), VEHICLE, at(181));
        assert!(is_known(&mut registrar, MAX_REGISTERED, at(181)) && !is_known(&mut registrar, 7, at(181)));
        assert_eq!(registrar.report().count(), MAX_REGISTERED);
    }

    #[test]
    fn a_flood_of_agents_that_share_nothing_keeps_the_place_of_nobody_who_does_and_shuts_out_no_newcomer() {
        let mut registrar = Registrar::new(Registration::Correct);
        (0..MAX_REGISTERED).for_each(|k| registrar.describe(name(k), VEHICLE, at(0)));
        let [one, other] = [3, 5].map(RegistrationSlot);
        registrar.links.note(one, other, 30);
        registrar.describe(name(100), VEHICLE, at(1));
        assert_eq!(registrar.left_out(at(1)).collect::<Vec<_>>(), [name(100)]);
        assert!(!is_known(&mut registrar, 100, at(9)), "they have time to meet others");
        for k in (0..MAX_REGISTERED).filter(|k| *k != 7) {
            assert!(is_known(&mut registrar, k, at(10)));
        }
        assert!(is_known(&mut registrar, 100, at(11)), "by its frames, without another description");
        assert_eq!(registrar.left_out(at(11)).count(), 0, "the other one was silent");
        for k in 200..300 {
            registrar.describe(name(k), VEHICLE, at(12));
        }
        assert!([3, 5].into_iter().all(|k| is_known(&mut registrar, k, at(12))));
        assert!((1..=MAX_LEFT_OUT).contains(&registrar.left_out(at(12)).count()));
    }

    #[test]
    fn an_agent_without_a_sensor_pose_or_a_description_is_not_registered() {
        let mut registrar = Registrar::new(Registration::Correct);
        registrar.describe(name(0), VEHICLE, at(0));
        let id = FrameId { agent: name(0), epoch: 1, sequence: 1 };
        assert_eq!(registrar.source_of(&DetectionFrame::empty(id, at(0)), at(0)), None);
        assert!(is_known(&mut registrar, 0, at(0)) && !is_known(&mut registrar, 1, at(0)));
        let mut off = Registrar::new(Registration::Off);
        off.describe(name(0), VEHICLE, at(0));
        assert!(!is_known(&mut off, 0, at(0)));
    }
}

//! Links delay frames as configured, and late frames are fused correctly.

use crate::{PATIENCE, PATIENT_HUB, inclusion};
use std::time::Duration;
use v2x_common::class::Class;
use v2x_common::clock;
use v2x_common::fused::FusedFrame;
use v2x_common::time::Span;
use v2x_fusion_hub::hub::HubStatus;
use v2x_lab::loopback::{Actor, Agent, KitError, Network, Noise, Script, Sent};

const DELAY: Duration = Duration::from_millis(700);

#[tokio::test(flavor = "multi_thread")]
async fn a_frame_is_fused_after_the_delay_of_its_link_and_a_later_frame_can_overtake_it()
-> Result<(), KitError> {
    let network = Network::start_with(PATIENT_HUB).await?;
    let late = network.agent("late").late_by(DELAY).join().await?;
    let prompt = network.agent("prompt").join().await?;
    let (sent_late, sent_promptly) = (late.send(Vec::new())?, prompt.send(Vec::new())?);
    let mut order = Vec::new();
    let both = |fused: &FusedFrame| {
        for sent in [sent_late, sent_promptly] {
            order.extend(inclusion(fused, sent.frame).map(|inclusion| (inclusion, fused.fused_at)));
        }
        order.len() == 2
    };
    network.await_fused(both, PATIENCE).await?;
    let [(first, _), (second, fused_at)] = order[..] else { panic!("two frames, not {order:?}") };
    assert_eq!((first.frame, second.frame), (sent_promptly.frame, sent_late.frame));
    let asked = Span::from_nanos(DELAY.as_nanos() as i64);
    let (on_the_way, until_fused) = (second.received_at - second.captured_at, fused_at - second.captured_at);
    assert!(on_the_way >= asked && until_fused >= on_the_way, "{on_the_way} {until_fused}");
    // The frame is put at the announced time, within the resolution of the timer (1 ms).
    assert!(sent_late.arrives_at.is_some_and(|at| second.received_at >= at), "{sent_late:?} {second:?}");
    network.end().await.map(|_| ())
}

#[tokio::test(flavor = "multi_thread")]
async fn late_detections_of_a_moving_object_give_its_present_position() -> Result<(), KitError> {
    let network = Network::start_with(PATIENT_HUB).await?;
    let camera = network.agent("camera").late_by(DELAY).seed(3).join().await?;
    let car = Actor::car(0.0, 5.0).driving(20.0, 0.0);
    let noise = Noise { position_m: 0.05, ..Noise::default() };
    camera.play(Script::every(Duration::from_millis(100)).of([car]).with_noise(noise))?;
    let start = network.started_at();
    let error_m = |fused: &FusedFrame| {
        let truth = car.bev_at(fused.fused_at - start);
        let distances = fused.objects.iter().map(|object| object.bev.pose().distance_to(truth.x, truth.y));
        distances.fold(f64::INFINITY, f64::min)
    };
    // Its position at capture is 14 m behind.
    let there = network.await_fused(|fused| error_m(fused) < 1.0, PATIENCE).await?;
    assert_eq!(there.objects.len(), 1, "{there:?}");
    let mut worst_m = 0.0_f64;
    let settled = |fused: &FusedFrame| {
        worst_m = worst_m.max(error_m(fused));
        fused.agents.iter().any(|agent| agent.accepted >= 20)
    };
    network.await_fused(settled, PATIENCE).await?;
    assert!(worst_m < 5.0, "it went astray by {worst_m} m");
    network.end().await.map(|_| ())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_late_accurate_frame_corrects_an_earlier_less_accurate_one() -> Result<(), KitError> {
    let network = Network::start_with(PATIENT_HUB).await?;
    let (accurate, inaccurate) = (
        network.agent("accurate").late_by(DELAY).join().await?,
        network.agent("inaccurate").seed(11).join().await?,
    );
    // A barrier is static, so it is not predicted to move.
    let captured_at = clock::now();
    let report = |agent: &Agent, x, position_m| {
        let barrier = Actor::new(Class::Barrier, x, -4.0);
        let seen = barrier.detection(Span::ZERO, Noise { position_m, ..Noise::default() });
        agent.send_frame(&agent.frame(captured_at, vec![seen]))
    };
    let sent = [report(&inaccurate, 33.0, 2.0)?, report(&accurate, 30.0, 0.1)?];
    let mut published = Vec::new();
    for sent in sent {
        let contains = |fused: &FusedFrame| inclusion(fused, sent.frame).is_some();
        let fused = network.await_fused(contains, PATIENCE).await?;
        published.push(fused.objects.iter().map(|object| object.bev.x).collect::<Vec<_>>());
    }
    let [[before], [after]] = [&published[0][..], &published[1][..]] else {
        panic!("one object each, not {published:?}")
    };
    // With the weights 1/2² and 1/0.1² the second position is 30.0075.
    assert!((before - 33.0).abs() < 0.01 && (after - 30.0075).abs() < 0.01, "{published:?}");
    network.end().await.map(|_| ())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_named_link_loses_its_fraction_and_the_same_frames_with_the_same_seed() -> Result<(), KitError> {
    let mut fates = Vec::new();
    for seed in [5, 5, 6] {
        let network = Network::start_with(PATIENT_HUB).await?;
        let agent = network.agent("camera").over("its-g5:loss=0.5").seed(seed).join().await?;
        let sent: Vec<Sent> = (0..40).map(|_| agent.send(Vec::new())).collect::<Result<_, _>>()?;
        let arrives: Vec<_> = sent.iter().map(|sent| sent.arrives_at.is_some()).collect();
        let arriving = arrives.iter().filter(|arrives| **arrives).count();
        // Five standard deviations of a fair coin.
        assert!((4..=36).contains(&arriving), "{arriving} of 40 at a loss of one half");
        let all_in = |status: &HubStatus| status.agents.iter().any(|agent| agent.accepted == arriving as u64);
        network.await_status(all_in, PATIENCE).await?;
        fates.push(arrives);
        network.end().await?;
    }
    assert!(fates[0] == fates[1] && fates[0] != fates[2], "{fates:?}");
    Ok(())
}

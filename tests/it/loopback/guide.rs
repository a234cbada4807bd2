//! The example of deploy/docs/guide.md, as it stands there.

use std::time::Duration;
use v2x_lab::loopback::{Actor, KitError, Network, Script};

#[tokio::test(flavor = "multi_thread")] // without Tokio: v2x_lab::loopback::block_on
async fn a_car_that_a_late_camera_sees_is_fused() -> Result<(), KitError> {
    let network = Network::start_with("delta_max_ms = 1000").await?;
    let camera = network.agent("camera").over("lte-uu:loss=0.1").seed(7).join().await?;
    camera.play(Script::every(Duration::from_millis(100)).of([Actor::car(10.0, 5.0).driving(8.0, 0.0)]))?;
    network.await_fused(|frame| frame.objects.len() == 1, Duration::from_secs(20)).await?;
    network.end().await.map(|_| ())
}

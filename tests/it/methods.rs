//! Hubs with other methods than ours.

use crate::support::Lab;
use v2x_common::fused::FusedObject;

#[tokio::test(flavor = "multi_thread")]
async fn a_hub_fuses_by_the_method_of_its_settings() -> anyhow::Result<()> {
    let lab = Lab::with_method("least-squares", "csba-wls")?;
    let hub = lab.hub().await?;
    let watch = lab.watch(&hub).await?;
    let _agents = [lab.agent("ego", &hub).await?, lab.agent("rsu", &hub).await?];
    let is_shared = |object: &FusedObject| object.contributors.len() == 2;
    let fused = watch.until("both agents in one object", |frame| frame.objects.iter().any(is_shared)).await?;
    // A method without memory has no velocities and no coasting objects.
    for object in &fused.objects {
        assert_eq!(object.velocity, (0.0, 0.0));
        assert!(
            (fused.fused_at - object.last_measured_at - object.age).as_secs_f64().abs() < 1e-3,
            "{object:?}"
        );
    }
    Ok(())
}

//! Sensor descriptions of agents.

use crate::{PATIENCE, PATIENT_HUB};
use v2x_lab::loopback::v2x_common::sensor::{Accuracy, FieldOfView, SensorDescription, SensorKind};
use v2x_lab::loopback::{HubStatus, KitError, Network};

const DESCRIPTION: SensorDescription = SensorDescription {
    revision: 1,
    kind: SensorKind::RoadsideUnit,
    field_of_view: FieldOfView::omnidirectional(0.0, 80.0),
    detection_probability: 0.9,
    clutter_per_m2: 1e-5,
    size_noise: None,
    body: None,
    accuracy: Accuracy { position_m: 0.02, yaw_rad: 0.0, clock_s: 1e-6 },
    rate_hz: 10.0,
};

#[tokio::test(flavor = "multi_thread")]
async fn the_hub_lists_the_description_of_a_described_sensor_only() -> Result<(), KitError> {
    let network = Network::start_with(PATIENT_HUB).await?;
    let mast = network.agent("mast").described(DESCRIPTION).join().await?;
    let mute = network.agent("mute").join().await?;
    let of = |status: &HubStatus, name: &str| {
        status.agents.iter().find(|agent| agent.id.as_str() == name).and_then(|agent| agent.sensor)
    };
    for agent in [&mast, &mute] {
        agent.send(Vec::new())?;
    }
    let both_heard = |status: &HubStatus| {
        let heard = status.agents.iter().filter(|agent| agent.accepted == 1).count();
        heard == 2 && of(status, "mast").is_some()
    };
    let status = network.await_status(both_heard, PATIENCE).await?;
    assert_eq!((of(&status, "mast"), of(&status, "mute")), (Some(DESCRIPTION), None));
    drop((mast, mute));
    network.end().await.map(|_| ())
}

#[tokio::test(flavor = "multi_thread")]
async fn an_invalid_description_is_an_error_before_the_agent_joins() -> Result<(), KitError> {
    let network = Network::start().await?;
    let never = SensorDescription { detection_probability: 2.0, ..DESCRIPTION };
    let outcome = network.agent("mast").described(never).join().await;
    let error = outcome.map(|agent| agent.id()).expect_err("refused").to_string();
    assert!(error.contains("mast") && error.contains("detection_probability"), "{error}");
    network.end().await.map(|_| ())
}

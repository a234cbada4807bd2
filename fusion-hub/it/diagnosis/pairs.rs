//! Each kind of finding has a test that provokes it, and one of what is nearly that and is not: this is the list of both.

use std::path::Path;

/// A kind of finding, the test that provokes it, and the one in which it is not found; files from the root of the workspace.
type Pair = (&'static str, (&'static str, &'static str), (&'static str, &'static str));

const ARRIVALS: &str = "fusion-hub/it/diagnosis/arrivals.rs";
const CLOCKS: &str = "fusion-hub/it/diagnosis/clocks.rs";
const CONTENTS: &str = "fusion-hub/it/diagnosis/contents.rs";
const HEADINGS: &str = "fusion-hub/it/diagnosis/headings.rs";
const NEAR: &str = "fusion-hub/it/diagnosis/near_misses.rs";
const POSITIONS: &str = "fusion-hub/it/diagnosis/positions.rs";
const REPETITION: &str = "fusion-hub/it/diagnosis/repetition.rs";
const VELOCITIES: &str = "fusion-hub/it/diagnosis/velocities.rs";
const FALSE_ALARMS: &str = "fusion-hub/it/false_alarms.rs";
const HEALTH: &str = "fusion-hub/src/hub/health.rs";
const CROWDING: &str = "fusion-hub/src/hub/crowding.rs";
const DENIALS: &str = "fusion-hub/src/hub/denials.rs";
const STRAYS: &str = "deploy/src/check/strays.rs";
const UNSERVED: &str = "deploy/src/check/unserved.rs";
const CHECK: &str = "deploy/src/check/run.rs";
const JUDGE: &str = "fusion-hub/src/diagnosis/judge/mod.rs";
const NOTHING: &str = "fusion-hub/src/diagnosis/judge/nothing.rs";
const STAMPS: &str = "fusion-hub/src/diagnosis/arrivals.rs";

const CLOCK: &str = "a_clock_that_is_behind_is_distinguished_from_a_slow_link";
const FEW: &str = "few_lost_frames_a_link_that_varies_by_tenths_and_empty_frames_are_no_fault_of_an_agent";
const NEARLY_LATE: &str = "a_delay_of_two_tenths_of_a_second_that_all_frames_have_is_no_clock_that_is_off";
const WHOLE_TURN: &str = "headings_of_a_whole_turn_and_a_few_boxes_that_are_the_wrong_way_round_are_right";
const COMPASS: &str = "a_compass_and_other_origins_of_headings_are_named_with_the_line_that_says_so";
const ENDS_OF_RANGES: &str = "values_at_the_end_of_their_range_and_what_is_left_out_are_not_impossible";
const MIRRORED: &str = "positions_from_the_sensor_mirrored_and_swapped_ones_are_named";
const A_HAND: &str = "a_shift_by_a_hands_breadth_is_no_other_frame";
const CROWD: &str = "cars_beside_each_other_and_people_close_together_are_neither_twins_nor_another_unit";
const LONG_VIEW: &str = "a_long_view_is_not_far_from_its_sensor_nor_far_away";
const SIGMAS: &str = "missing_and_false_standard_deviations_are_reported";
const NEAR_SIGMAS: &str = "errors_that_are_stated_half_as_large_again_or_a_third_too_small_are_right_enough";
const NAMES: &str = "unknown_classes_impossible_values_and_refusals_are_reported_with_their_names";
const DELIVERED_TWICE: &str = "a_frame_that_is_delivered_twice_is_no_part_and_no_repetition";
const GAPS: &str = "gaps_jitter_and_silence_are_reported";
const DESCRIPTION: &str = "a_refused_description_and_a_rate_below_the_declared_one_are_reported";
const KEYS: &str = "another_network_a_misspelt_key_a_foreign_key_and_a_name_are_distinguished";
const NO_STRAY: &str = "what_a_hub_or_nobody_of_ours_publishes_is_no_stray";
const TWO_HUBS: &str = "another_hub_of_this_name_and_one_with_other_settings_are_told_and_none_are_not";
const GONE: &str = "an_agent_that_the_settings_name_and_that_is_gone_makes_a_hub_degraded_by_its_name";
const NOBODY: &str =
    "that_no_agent_sends_says_who_has_ended_and_is_not_told_beside_its_cause_or_of_who_is_there";
const FIELD: &str = "a_described_view_that_is_not_that_of_the_detections_is_named_with_the_field_to_correct";
const NEVER_FORGETS: &str =
    "a_list_of_tracks_that_never_forgets_is_told_as_such_and_a_tracker_that_keeps_what_is_missed_is_not";
const FED_BACK: &str = "an_agent_that_publishes_the_hubs_own_objects_is_told_and_nobody_else_is_blamed";
const PLACES_IN_A_LIST: &str =
    "places_in_a_list_as_numbers_of_tracks_are_told_and_tracks_that_stay_with_objects_are_not";
const EMPTY: &str =
    "an_agent_whose_frames_are_all_empty_is_a_note_and_one_that_sees_something_at_times_is_none";
const TWO_AREAS: &str =
    "agents_of_one_area_that_see_nothing_together_are_a_note_and_those_of_two_areas_are_none";
const OUTDATED: &str = "findings_of_an_earlier_time_are_said_to_be_of_it";
const FULL: &str = "that_there_are_no_places_for_more_errors_is_a_note_and_that_all_have_one_is_none";

#[rustfmt::skip]
const PAIRS: [Pair; 63] = [
    ("ClockAhead", (CLOCKS, CLOCK), (NEAR, NEARLY_LATE)),
    ("ClockBehind", (CLOCKS, CLOCK), (NEAR, NEARLY_LATE)),
    ("ClockBehindOrLinkSlow", (CLOCKS, "a_clock_behind_of_a_lone_agent_is_told_in_the_same_check_as_its_other_faults"), (NEAR, NEARLY_LATE)),
    ("LinkSlow", (CLOCKS, CLOCK), (NEAR, FEW)),
    ("TimeUnit", (CLOCKS, "stamps_of_another_unit_are_named"), (CLOCKS, "stamps_that_count_from_1980_are_named_and_those_of_another_day_are_a_clock")),
    ("OneStamp", (CLOCKS, "one_stamp_for_all_frames_is_one_finding_and_not_two_about_clocks_and_processes"), (STAMPS, "a_stamp_that_never_changes_is_seen_after_some_frames_and_not_beside_another_one")),
    ("StampsJitter", (CLOCKS, "stamps_that_scatter_are_told_to_jitter_with_what_to_do_and_no_offset_that_would_not_mend_them"), (NEAR, FEW)),
    ("Degrees", (HEADINGS, "headings_in_degrees_are_named_with_the_line_that_says_so"), (NEAR, WHOLE_TURN)),
    ("HeadingsMirrored", (HEADINGS, COMPASS), (NEAR, WHOLE_TURN)),
    ("HeadingsRotated", (HEADINGS, COMPASS), (NEAR, WHOLE_TURN)),
    ("HeadingsReversed", (HEADINGS, COMPASS), (NEAR, WHOLE_TURN)),
    ("HeadingsUnfit", (HEADINGS, "headings_that_are_always_the_same_and_those_of_axes_are_named_and_right_ones_of_a_road_are_not"), (NEAR, WHOLE_TURN)),
    ("SizesSwapped", (CONTENTS, "swapped_sizes_are_named"), (NEAR, WHOLE_TURN)),
    ("Sizes", (CONTENTS, "sizes_that_no_vehicles_have_are_named_and_those_of_small_and_large_ones_are_not"), (NEAR, ENDS_OF_RANGES)),
    ("Velocities", (VELOCITIES, "velocities_in_other_units_and_along_other_axes_are_named_and_right_ones_are_not"), (VELOCITIES, "zero_velocities_of_what_is_parked_and_of_a_few_that_move_are_right")),
    ("Geodetic", (POSITIONS, "degrees_of_longitude_and_latitude_are_named"), (FALSE_ALARMS, "what_is_parked_near_the_origin_is_no_longitude_and_latitude")),
    ("SensorFrame", (POSITIONS, MIRRORED), (NEAR, A_HAND)),
    ("Axes", (POSITIONS, MIRRORED), (NEAR, A_HAND)),
    ("LengthUnit", (POSITIONS, "positions_in_another_unit_of_length_are_named"), (POSITIONS, "objects_that_are_reported_where_the_sensor_sees_them_first_and_shifts_are_no_unit")),
    ("SensorPose", (POSITIONS, "a_pose_of_the_wrong_sign_order_or_direction_is_named"), (NEAR, A_HAND)),
    ("NothingShared", (POSITIONS, TWO_AREAS), (NEAR, A_HAND)),
    ("Offset", (POSITIONS, "a_shift_and_a_turn_between_agents_are_reported_in_metres_and_degrees"), (NEAR, A_HAND)),
    ("PoseWanders", (CONTENTS, "a_pose_that_wanders_is_named_with_its_size"), (CONTENTS, "a_pose_that_wanders_is_named_with_its_size")),
    ("BeganAgain", (HEALTH, "a_restart_by_itself_is_told_for_a_while"), (HEALTH, "a_restart_by_itself_is_told_for_a_while")),
    ("Twins", (CONTENTS, "each_vehicle_reported_twice_is_a_note"), (NEAR, CROWD)),
    ("PartialFrames", (REPETITION, "one_message_for_each_object_of_a_time_is_told_as_such"), (NEAR, DELIVERED_TWICE)),
    ("Repetition", (REPETITION, "a_result_that_is_sent_several_times_under_new_stamps_is_told"), (NEAR, DELIVERED_TWICE)),
    ("Feedback", (REPETITION, FED_BACK), (REPETITION, FED_BACK)),
    ("Copy", (REPETITION, "an_agent_that_publishes_what_another_one_does_is_named_whatever_its_stamp_and_pose"), (REPETITION, "two_agents_whose_reports_have_no_errors_are_no_copies")),
    ("StaleObjects", (REPETITION, NEVER_FORGETS), (REPETITION, "exact_reports_of_what_brakes_and_then_stands_are_nothing_that_was_lost")),
    ("SourceTracks", (REPETITION, PLACES_IN_A_LIST), (REPETITION, PLACES_IN_A_LIST)),
    ("SeesNothing", (CONTENTS, EMPTY), (CONTENTS, EMPTY)),
    ("FarFromSensor", (POSITIONS, "pixels_are_further_from_the_sensor_than_any_sees"), (NEAR, LONG_VIEW)),
    ("FieldOfView", (ARRIVALS, FIELD), (ARRIVALS, FIELD)),
    ("FarAway", (POSITIONS, "positions_far_from_all_others_are_reported"), (NEAR, LONG_VIEW)),
    ("SigmaMissing", (CONTENTS, SIGMAS), (CONTENTS, SIGMAS)),
    ("SigmaTooSmall", (CONTENTS, SIGMAS), (NEAR, NEAR_SIGMAS)),
    ("SigmaTooLarge", (CONTENTS, SIGMAS), (NEAR, NEAR_SIGMAS)),
    ("UnknownClasses", (CONTENTS, NAMES), (NEAR, "names_that_other_detectors_use_are_no_unknown_classes")),
    ("ImpossibleDetections", (CONTENTS, NAMES), (NEAR, ENDS_OF_RANGES)),
    ("FramesRefused", (CONTENTS, NAMES), (NEAR, ENDS_OF_RANGES)),
    ("DescriptionRefused", (ARRIVALS, DESCRIPTION), (ARRIVALS, DESCRIPTION)),
    ("TwoProcesses", (ARRIVALS, "two_processes_with_one_name_are_noticed_with_epochs_and_without"), (ARRIVALS, "one_process_of_minimal_json_is_not_taken_for_two_whatever_its_link_and_its_detector_do")),
    ("Gaps", (ARRIVALS, GAPS), (NEAR, FEW)),
    ("RateLow", (ARRIVALS, DESCRIPTION), (ARRIVALS, DESCRIPTION)),
    ("Jitter", (ARRIVALS, GAPS), (NEAR, FEW)),
    ("Silent", (ARRIVALS, GAPS), (NEAR, FEW)),
    ("Idle", (ARRIVALS, "an_agent_whose_vehicle_is_not_in_the_world_is_idle_and_not_silent"), (ARRIVALS, "an_agent_that_waits_for_nothing_is_not_idle")),
    ("WrongKey", (STRAYS, KEYS), (STRAYS, NO_STRAY)),
    ("WrongNetwork", (STRAYS, KEYS), (STRAYS, NO_STRAY)),
    ("InvalidName", (STRAYS, KEYS), (HEALTH, "a_name_that_is_not_allowed_is_told_and_only_that")),
    ("Missing", (HEALTH, GONE), (HEALTH, GONE)),
    ("NoAgents", (HEALTH, NOBODY), (HEALTH, NOBODY)),
    ("NothingFused", (NOTHING, "lists_without_an_object_are_a_fault_where_an_agent_reports_what_lasts"), (NOTHING, "lists_without_an_object_are_right_where_nothing_is_seen_or_only_clutter")),
    ("NoHub", (UNSERVED, "a_hub_that_ended_while_it_was_listened_to_is_gone_and_not_overloaded"), (UNSERVED, "who_stands_in_for_a_hub_misses_none_and_nothing_at_all_is_no_finding")),
    ("Outdated", (CHECK, OUTDATED), (CHECK, OUTDATED)),
    ("TwoHubs", (HEALTH, TWO_HUBS), (HEALTH, TWO_HUBS)),
    ("Overload", (ARRIVALS, "a_full_queue_of_an_agent_is_overload_with_what_to_do"), (HEALTH, "samples_that_are_dropped_are_overload_for_a_while_and_none_are_not")),
    ("Sessions", (CROWDING, "a_flood_of_sessions_by_one_cert_is_a_note_that_names_it_and_a_fault_when_others_lack_places"), (CROWDING, "a_flood_of_agents_without_certs_on_one_machine_is_no_finding_as_long_as_there_are_places")),
    ("RefusedByZenoh", (DENIALS, "frames_under_a_name_that_is_not_the_certificates_are_a_fault_as_long_as_they_come"), (DENIALS, "what_the_acl_denies_to_strangers_and_what_is_only_read_is_a_note")),
    ("Recording", (HEALTH, "a_fault_of_the_recording_is_found_while_it_has_gaps_and_for_good_when_it_has_ended"), (HEALTH, "a_fault_of_the_recording_is_found_while_it_has_gaps_and_for_good_when_it_has_ended")),
    ("StandbyDiffers", (HEALTH, TWO_HUBS), (HEALTH, TWO_HUBS)),
    ("RegistrationFull", (JUDGE, FULL), (JUDGE, FULL)),
];

fn read(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The variants of `Code`, as its source has them.
fn codes() -> Vec<String> {
    let source = read("fusion-hub/src/diagnosis/finding.rs");
    let of_enum = source.split("pub enum Code {").nth(1).and_then(|rest| rest.split("\n}").next());
    let lines = of_enum.expect("the enum").lines().map(str::trim);
    let names = lines.filter(|line| !line.starts_with("//") && !line.starts_with('#'));
    names.filter_map(|line| line.strip_suffix(',')).map(str::to_owned).collect()
}

/// Whether there is a test of this name in a file, which is not ignored.
fn is_test(path: &str, name: &str) -> bool {
    let source = read(path);
    let Some(at) = source.find(&format!("fn {name}(")) else { return false };
    let attributes = source[..at].rsplit("\n\n").next().unwrap_or_default();
    attributes.contains("test") && attributes.contains("#[") && !attributes.contains("ignore")
}

#[test]
fn each_kind_of_finding_has_a_test_that_provokes_it_and_one_of_what_is_nearly_that() {
    let listed: Vec<_> = PAIRS.iter().map(|(code, ..)| (*code).to_owned()).collect();
    assert_eq!(listed, codes(), "each kind of finding, in the order of `Code`, has its pair of tests here");
    for (code, provoked, nearly) in PAIRS {
        for (path, name) in [provoked, nearly] {
            assert!(is_test(path, name), "{code}: no test {name} in {path}");
        }
    }
}

//! Commands of `lab` that work on files: exit codes, standard output and standard error.

use crate::folder::Folder;

const LOG: &str = "t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st\n\
    5.0,4.9,a,car,1,2,2,4,0,0.5,0.5,0.2,0.4,0.1\n\
    5.2,5.1,b,car,1,2,2,4,0,0.5,0.5,0.2,0.4,0.1\n";

#[test]
fn a_log_is_fused_and_an_invalid_one_gives_a_failing_exit_code() {
    let folder = Folder::new("fuse");
    folder.write("log.csv", LOG);
    let report = folder.json("fuse --detections log.csv --out fused.csv --json");
    assert_eq!((&report["frames"], &report["ticks"], &report["truth"]), (&2.into(), &3.into(), &().into()));
    let fused = std::fs::read_to_string(folder.0.join("fused.csv")).unwrap();
    // The first report of an agent that declares nothing is a candidate; the second one confirms it.
    assert_eq!(fused.lines().count(), 1 + 1, "{fused}");
    folder.write("back.csv", &(LOG.to_owned() + "5.1,5.1,b,car,1,2,2,4,0,0.5,0.5,0.2,0.4,0.1\n"));
    folder.write("bare.csv", "t,x\n1,2\n");
    for (log, expected) in [
        ("back.csv", "back.csv, line 4, column t_arr: \"5.1\""),
        ("bare.csv", "bare.csv has no column t_arr, sensor_id, class, y, w, d, yaw, sx, sy, sw, sd, st;"),
        ("none.csv", "cannot read none.csv"),
        ("log.csv --method best", "invalid value 'best' for '--method <KEY>': expected one of ours, "),
        ("log.csv --clutter-per-frame 1", "--range <M>"),
        ("log.csv --range 0", "field_of_view.range_max_m is 0"),
        ("log.csv --truth none.csv", "cannot read none.csv"),
    ] {
        let complaint = folder.complaint(&format!("fuse --out other.csv --detections {log}"));
        assert!(complaint.contains(expected), "{complaint}");
        assert!(!folder.0.join("other.csv").exists(), "{log}");
    }
}

#[test]
fn an_export_becomes_a_row_in_the_tables() {
    let folder = Folder::new("score");
    let mut scenes = "scene,frame,t_s,object_id,class,x,y,width,length,yaw,ego_x,ego_y,ego_yaw\n".to_owned();
    for frame in 0..4 {
        for object in 0..3 {
            let row = format!("a/b,{frame},{},{object},car,{},0,2,4,0,0,0,0\n", frame * 2, 30 * object + 10);
            scenes += &row;
        }
    }
    folder.write("boxes.csv", &scenes);
    let export = "export --dataset csv:boxes.csv --noise N1-N3 --trials 2 --seed 9 --out export";
    assert!(folder.lab(export).status.success());
    assert!(folder.complaint(export).contains("export.json is there already"));
    let score = "score --name mine --told nothing --table II --methods single-1 --json";
    let complaint = folder.complaint(&format!("{score} --export export boxes.csv"));
    assert!(complaint.contains("2 of 2 files of the export have no counterpart"), "{complaint}");
    let complaint = folder.complaint(&format!("{score} boxes.csv"));
    assert!(complaint.contains("there is no export.json in boxes.csv or above it"), "{complaint}");
    let complaint = folder.complaint("score nowhere");
    assert!(complaint.contains("nowhere"), "{complaint}");
    let complaint = folder.complaint(&format!("{score} export"));
    assert!(complaint.contains("a_b.csv has no column track_id"), "{complaint}");
    for trial in 0..2 {
        let path = format!("N1-N3/trial-{trial}/a_b.csv");
        let table = std::fs::read_to_string(folder.0.join("export").join(&path)).unwrap();
        let mut fused = "t,track_id,class,x,y,w,d,yaw,det_ids\n".to_owned();
        for row in table.lines().filter(|row| row.contains(",agent-1,")) {
            let cells: Vec<&str> = row.split(',').collect();
            fused += &format!("{},{},{},{}\n", cells[1], cells[14], cells[3..9].join(","), cells[14]);
        }
        folder.write(&format!("fused/{path}"), &fused);
    }
    let rows = folder.json(&format!("{score} fused --export export"));
    let mean = |method: &str| {
        let of = |row: &&serde_json::Value| row["method"] == method && row["subset"] == "all";
        let row = rows.as_array().unwrap().iter().find(of).unwrap();
        (row["mate_m"].as_f64().unwrap(), row["told"].as_str().unwrap().to_owned())
    };
    let (single, mine) = (mean("single-1"), mean("mine"));
    assert!((single.0 - mine.0).abs() < 1e-12 && single.0 > 0.0, "{single:?} {mine:?}");
    assert_eq!(mine.1, "nothing");
}

#[test]
fn a_reader_that_closes_early_ends_a_command_quietly() {
    let folder = Folder::new("closed-reader");
    folder.write("log.csv", LOG);
    for arguments in
        ["fuse --detections log.csv --out fused.csv", "fuse --detections log.csv --out fused.csv --json"]
    {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = folder.command(arguments).stdout(writer).output().unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && errors.is_empty(), "{arguments}: {errors}");
    }
}

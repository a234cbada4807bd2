//! Options of `lab score`.

use crate::commands::tables::RowArgs;
use std::path::PathBuf;

/// Score a recorded run again; or, with --name, score the output of your own method on exported detections
///
/// Without --name: the folder of a run that v2x demo recorded; its report is written again.
/// With --name: one more row with this name in every table of lab tables.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Your own method's output mirrors the export: FUSED/N1-N3/trial-0/SCENE.csv, a
row for each box, in the columns
  t,track_id,class,x,y,w,d,yaw  and, where there are,
                                det_ids,existence,vx,vy,sx,sy,sw,sd,st
det_ids are the exported det_id values that a box was made of, with ; or spaces
between. By them it is known which true object a box is scored against: that of
agent 1's detection of this keyframe, else of agent 2's, else of its newest one.
Without this column boxes are matched by position, and the row says so.

Examples:
  lab score v2x-runs/2026-11-28_14-05-31-crossing
  lab score --name mine fused --export detections
  lab score --name mine fused --table II --methods csba-wls,unikf-paper,ours")]
pub struct ScoreArgs {
    /// The folder of the run; with --name folders with the layout of the export, or single files of it
    #[arg(required = true, value_name = "FOLDER|FUSED")]
    pub paths: Vec<PathBuf>,
    /// Name of the method in the tables
    #[arg(long)]
    pub name: Option<String>,
    /// The folder of the export [default: the nearest one with export.json, from a FUSED folder upwards]
    #[arg(long, value_name = "DIR")]
    pub export: Option<PathBuf>,
    /// Inputs of the method other than boxes and classes, for example "σ, past frames"
    #[arg(long = "told", value_name = "TEXT")]
    pub inputs: Option<String>,
    /// The tables to print with --name.
    #[command(flatten)]
    pub rows: RowArgs,
    /// Print the summary, or all rows, as one line of JSON
    #[arg(long)]
    pub json: bool,
}

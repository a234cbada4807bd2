//! `lab tables`: the tables and figures of the paper, with our values beside them.

pub(crate) mod args;

pub use args::TablesArgs;
pub(crate) use args::{Detectors, RowArgs};

use crate::data::scene::Scene;
use crate::drive::keyframes::contender::Contender;
use crate::report::output::print;
use crate::report::progress::Progress;
use crate::report::tables::kind::Table;
use crate::report::tables::results::Tables;
use crate::report::tables::{files, text};

/// Computes and prints the tables.
pub fn tables(args: &TablesArgs) -> anyhow::Result<()> {
    tables_with(args, Vec::new())
}

/// Computes and prints the tables, with further methods as rows of every table.
pub fn tables_with(args: &TablesArgs, further: Vec<Contender>) -> anyhow::Result<()> {
    tables_of(args, &args.draws().scenes()?, further)
}

/// Like [`tables_with`], for scenes in memory.
#[expect(clippy::print_stderr, reason = "what people read while the JSON goes elsewhere")]
pub(crate) fn tables_of(args: &TablesArgs, scenes: &[Scene], further: Vec<Contender>) -> anyhow::Result<()> {
    let mut progress = Progress::begin("scenes × trials × noise");
    let study = args.study(further);
    let plan = args.plan(&study);
    let tables = Tables::of(scenes, (&study, plan), &args.dataset(), |done, of| progress.update(done, of))?;
    progress.end();
    let text = text::terminal(&tables);
    if let Some(folder) = args.out() {
        files::write(&tables, folder)?;
        eprintln!("written: {}", folder.join("report.html").display());
        if let Some(shown) = &tables.shown {
            let name = format!("{}-{}.svg", Table::Fig5.stem(), shown.setting.noise.name());
            eprintln!("written: {}", folder.join("plots").join(name).display());
        }
    }
    if args.is_json() {
        eprintln!("{text}");
        print(&(serde_json::to_string(&tables.rows)? + "\n"))?;
    } else {
        print(&(text + "\n"))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::conditions::Conditions;
    use crate::data::dataset::synthetic;
    use crate::data::noise::{NoisePair, Shape};
    use crate::data::test_scenes::parking;
    use crate::drive::keyframes::method::Method;
    use crate::report::tables::study::Study;
    use crate::report::tables::{figures, html, latex};
    use crate::score::keyframes::experiments::Plan;
    use crate::score::keyframes::moment::Moment;

    fn small(tables: &[Table], methods: &[Method]) -> Tables {
        of_scenes(tables, methods, &[3, 40].map(synthetic::scene))
    }

    fn of_scenes(tables: &[Table], methods: &[Method], scenes: &[Scene]) -> Tables {
        of_detectors(Conditions::Paper, (tables, methods), scenes)
    }

    fn of_detectors(
        conditions: Conditions,
        (tables, methods): (&[Table], &[Method]),
        scenes: &[Scene],
    ) -> Tables {
        let study = Study {
            tables: tables.to_vec(),
            noise: vec![NoisePair::N2N2, NoisePair::N1N3],
            methods: methods.to_vec(),
            shape: Shape::Gaussian,
            conditions,
            further: Vec::new(),
            moment: Moment::default(),
            is_brief: false,
        };
        let plan = Plan { experiments: study.experiments(), trials: 2, seed: 5, threads: 2 };
        Tables::of(scenes, (&study, plan), "synthetic", |_, _| {}).unwrap()
    }

    #[test]
    fn every_table_format_has_every_row() {
        let methods = [Method::Single1, Method::Nms, Method::CsbaWls, Method::Ours];
        let tables = small(&[Table::II], &methods);
        // Noise, method, counting, subset.
        assert_eq!(tables.rows.len(), 2 * 4 * 2 * 3);
        let (text, markdown) = (text::terminal(&tables), text::markdown(&tables));
        let (csv, latex) = (files::table_csv(&tables).unwrap(), latex::latex(&tables));
        assert_eq!(csv.lines().count(), 1 + tables.rows.len());
        for method in methods {
            let key = method.key();
            let lines_with =
                |text: &str, start: String| text.lines().filter(|line| line.starts_with(&start)).count();
            assert_eq!(lines_with(&text, format!("{key}  ")), 2, "{key}");
            assert_eq!(lines_with(&markdown, format!("| {key} |")), 2 * 4, "{key}");
            assert_eq!(latex.matches(&format!("\\texttt{{{key}}}")).count(), 2);
        }
        assert!(text.contains("ours over csba-wls, all objects: mATE"));
        assert!(latex.contains("\\multirow{4}{*}{Noise 3}"));
    }

    #[test]
    fn a_subset_without_objects_has_no_gain_and_no_number_in_any_format() {
        let methods = [Method::CsbaWls, Method::CsbaWlsCv, Method::Ours];
        // All cars are parked: nothing moves.
        let tables = of_scenes(&[Table::II], &methods, &[parking(3), parking(4)]);
        let terminal = text::terminal(&tables);
        let report = html::html(&tables, &figures::figures(&tables));
        let formats = [
            &terminal,
            &text::markdown(&tables),
            &report,
            &latex::latex(&tables),
            &files::table_csv(&tables).unwrap(),
        ];
        assert!(formats.iter().all(|text| !text.contains("NaN") && !text.contains("inf×")), "{terminal}");
        assert!(terminal.contains("ours over csba-wls, standing: mATE"));
        assert!(!terminal.contains("ours over csba-wls, moving"));
    }

    #[test]
    fn every_table_and_figure_has_rows_of_its_own() {
        let all = [Table::III, Table::IV, Table::Fig3, Table::Robustness, Table::Nees, Table::Sensors];
        let tables = small(&all, &[Method::Nms, Method::UnikfPaper, Method::Ours]);
        let text = text::terminal(&tables);
        for table in all {
            let n = tables.rows.iter().filter(|row| row.table == table).count();
            assert!(n > 0, "{table:?}");
            assert!(text.contains(&table.title()), "{table:?} in {text}");
        }
        let sensors =
            tables.rows.iter().find(|row| row.table == Table::Sensors && row.method == "ours").unwrap();
        let tracker = sensors.tracker;
        assert!(tracker.hota.unwrap() > 0.5 && tracker.gospa_m.unwrap() > 0.0 && tracker.amota.is_some());
        assert!(tracker.map.unwrap() > 0.3 && tracker.ap_iou_50.unwrap() > 0.1, "{tracker:?}");
        let of = |table, shape| {
            let row = tables.rows.iter().find(|row| row.table == table && row.shape == shape).unwrap();
            row.metrics.0[0].mean.unwrap()
        };
        assert_ne!(of(Table::Robustness, Shape::Gaussian), of(Table::Robustness, Shape::Laplace));
        let classes =
            |table| tables.rows.iter().filter(|row| row.table == table).all(|row| row.class.is_some());
        assert!(classes(Table::Fig3) && classes(Table::Nees) && !classes(Table::III));
    }

    #[test]
    fn tables_with_the_errors_of_detectors_have_all_metrics_of_tracking_and_detection() {
        let wanted = (&[Table::II, Table::III][..], &[Method::CsbaWls, Method::Ours][..]);
        let scenes = [3, 40].map(synthetic::scene);
        let tables = of_detectors(Conditions::Lidar, wanted, &scenes);
        let of_ours = tables.rows.iter().filter(|row| row.method == "ours").map(|row| row.tracker);
        for ours in of_ours {
            let nds = [ours.nuscenes_ate_m, ours.nuscenes_ase, ours.nuscenes_aoe_rad, ours.nuscenes_ave_mps];
            let parts: f64 = nds.iter().map(|error| (1.0 - error.unwrap()).max(0.0)).sum();
            let sum = (5.0 * ours.map.unwrap() + parts) / 9.0;
            // Means over two trials on both sides.
            assert!((ours.nds_without_attributes.unwrap() - sum).abs() < 0.02, "{ours:?}");
            let falling = |values: &[Option<f64>]| values.windows(2).all(|pair| pair[0] >= pair[1]);
            assert!(falling(&[ours.ap_iou_30, ours.ap_iou_50, ours.ap_iou_70]), "{ours:?}");
            assert!(falling(&[ours.ap_4_m, ours.ap_2_m, ours.ap_1_m, ours.ap_05_m]), "{ours:?}");
            assert!(ours.ap_iou_70 > Some(0.0) && ours.hota > Some(0.3), "{ours:?}");
            assert!(ours.nuscenes_ave_mps < Some(3.0), "its velocities count: {ours:?}");
        }
        let (terminal, markdown) = (text::terminal(&tables), text::markdown(&tables));
        for text in [&terminal, &markdown] {
            let n = |what: &str| text.matches(what).count();
            // Two tables at two levels of noise each; HOTA is in the note below, too.
            assert_eq!((n("AP IoU .3"), n("HOTA"), n("AVE m/s")), (4, 8, 4), "{text}");
        }
        let page = html::html(&tables, &figures::figures(&tables));
        assert_eq!(page.matches("<th>AVE m/s</th>").count(), 4);
        let csv = files::table_csv(&tables).unwrap();
        let header = csv.lines().next().unwrap();
        for column in ["ap_iou_30", "ap_iou_70", "ap_05_m", "ap_4_m", "nds_without_attributes", "hota"] {
            assert!(header.split(',').any(|one| one == column), "{column} in {header}");
        }
        let paper = small(&[Table::II], &[Method::Ours]);
        assert!(!text::terminal(&paper).contains("AP IoU") && paper.rows[0].tracker.map.is_none());
    }

    #[test]
    fn the_report_holds_every_table_and_figure_on_one_page() {
        let methods = [Method::Nms, Method::UnikfPaper, Method::Ours];
        let tables = small(&[Table::II, Table::Fig3, Table::Fig5, Table::Robustness], &methods);
        let figures = figures::figures(&tables);
        let names: Vec<&str> = figures.iter().map(|figure| figure.name.as_str()).collect();
        let expected = [
            "table-2-N2-N2",
            "table-2-N1-N3",
            "fig-3-N1-N3",
            "fig-5-N1-N3",
            "robustness-N2-N2",
            "robustness-N1-N3",
        ];
        assert_eq!(names, expected);
        let page = html::html(&tables, &figures);
        // Each panel is a drawing of its own; a picture clips within its own.
        let panels: usize = figures.iter().map(|figure| figure.parts.panels.len()).sum();
        assert_eq!(page.matches("role=\"img\"").count(), panels);
        assert_eq!(page.matches("<svg x=").count(), methods.len());
        for link in [
            "href=\"#table-2\"",
            "id=\"table-2\"",
            "counted as the paper prints its formula",
            "href=\"tables.csv\"",
            "href=\"plots/table-2-N1-N3.svg\"",
            "</p>\n<p>2 trials, seed 5",
            "<li>nms at N1-N1:",
            "Variants of ours are not counted",
        ] {
            assert!(page.contains(link), "{link}");
        }
        assert!(!page.contains("src="), "nothing from elsewhere");
        let moment = page.split("id=\"fig-5\"").nth(1).unwrap().split("</section>").next().unwrap();
        assert!(
            moment.contains("<th>GOSPA m</th>") && !moment.contains("mATE"),
            "the moment's own figures: {moment}"
        );
    }

    #[test]
    fn the_verdict_counts_each_setting_once_and_names_the_rival_with_an_interval() {
        let methods = [Method::Nms, Method::CsbaWls, Method::Ours, Method::OursLag1];
        let all = [Table::II, Table::III, Table::IV, Table::Fig3, Table::Fig5, Table::Ablation];
        let tables = small(&all, &methods);
        let page = html::html(&tables, &[]);
        let verdict = page.split("class=\"verdict").nth(1).unwrap().split("</div>").next().unwrap();
        assert!(verdict.contains("× csba-wls's (95 %: "), "{verdict}");
        assert!(verdict.contains("at N1-N3; ") && verdict.contains("over 2 settings"), "{verdict}");
    }

    #[test]
    fn the_same_seed_gives_the_same_bits_everywhere() {
        let tables = small(&[Table::II], &Method::TABLE_II[..11]);
        let numbers = tables.rows.iter().flat_map(|row| row.metrics.named()).filter_map(|(_, value)| value);
        let hash = numbers.fold(0u64, |hash, number| {
            hash.rotate_left(5).wrapping_add(number.to_bits()).wrapping_mul(0x0100_0000_01b3)
        });
        // The failing test prints the new value. It changes with noise, scenes, rules or counting.
        assert_eq!(hash, 7_090_604_563_049_918_763);
    }
}

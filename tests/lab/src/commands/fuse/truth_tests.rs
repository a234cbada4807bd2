//! A truth of another world, or in other units.

use super::tests::Folder;
use super::*;
use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt::Write as _;

/// A row of the truth.
#[derive(Clone, Copy)]
struct Car {
    t: f64,
    x: f64,
    y: f64,
    w: f64,
    d: f64,
    yaw: f64,
    speed: f64,
}

/// Twelve cars on the four lanes of a crossing, each of which begins again as another one.
fn cars(t: f64) -> Vec<(String, Car)> {
    let mut cars = Vec::new();
    for n in 0..3 {
        let along = |speed: f64| {
            let way = 26.0 * f64::from(n) + speed * t;
            (format!("{n}-{speed}-{}", (way / 78.0).floor()), way.rem_euclid(78.0) - 39.0)
        };
        for (speed, yaw) in [(9.0, 0.0), (8.0, PI), (7.0, -FRAC_PI_2), (10.0, FRAC_PI_2)] {
            let (name, along) = along(speed);
            let (sin, cos) = libm::sincos(yaw);
            // Two metres to the right of the middle.
            let (x, y) = (along * cos + 2.0 * sin, along * sin - 2.0 * cos);
            cars.push((name, Car { t, x, y, w: 1.8, d: 4.5, yaw, speed }));
        }
    }
    cars
}

fn log() -> String {
    let mut log = "t_arr,t,sensor_id,class,x,y,w,d,yaw,sx,sy,sw,sd,st\n".to_owned();
    for k in 0..200 {
        for (n, (_, car)) in cars(0.1 * f64::from(k)).into_iter().enumerate() {
            let noise = |axis: f64| 0.3 * libm::sin(12.9 * f64::from(k) + 78.2 * n as f64 + 37.7 * axis);
            let Car { t, x, y, w, d, yaw, .. } = car;
            let (x, y) = (x + noise(0.0), y + noise(1.0));
            writeln!(log, "{:.2},{t:.2},cam,car,{x},{y},{w},{d},{yaw},0.2,0.2,0.1,0.1,0.05", t + 0.03)
                .unwrap();
        }
    }
    log
}

fn truth(edit: impl Fn(&mut Car)) -> String {
    let mut truth = "t,object_id,class,x,y,vx,vy,w,d,yaw\n".to_owned();
    for k in 0..200 {
        for (name, mut car) in cars(0.1 * f64::from(k)) {
            let (sin, cos) = libm::sincos(car.yaw);
            let (vx, vy) = (car.speed * cos, car.speed * sin);
            edit(&mut car);
            let Car { t, x, y, w, d, yaw, .. } = car;
            writeln!(truth, "{t:.2},{name},car,{x},{y},{vx},{vy},{w},{d},{yaw}").unwrap();
        }
    }
    truth
}

#[test]
fn a_truth_in_other_units_of_another_place_or_time_is_told_and_a_right_one_is_not() {
    let folder = Folder::new("truth-check");
    let log = log();
    type Edit<'a> = &'a dyn Fn(&mut Car);
    let warnings = |edit: Edit<'_>| {
        let report = run(&folder.args(&log, Some(&truth(edit)))).unwrap();
        report.warnings.into_iter().filter(|one| one.contains("truth")).collect::<Vec<_>>()
    };
    assert_eq!(warnings(&|_| {}), Vec::<String>::new());
    let wrong: [(&str, Edit<'_>); 7] = [
        ("degrees", &|car| car.yaw = car.yaw.to_degrees().rem_euclid(360.0)),
        ("clockwise", &|car| car.yaw = FRAC_PI_2 - car.yaw),
        ("wider than long", &|car| std::mem::swap(&mut car.w, &mut car.d)),
        ("feet", &|car| (car.x, car.y) = (car.x / 0.3048, car.y / 0.3048)),
        ("", &|car| car.x += 10.0),
        ("", &|car| car.t += 0.5),
        ("", &|car| (car.x, car.y) = (car.y + 4.0, car.x)),
    ];
    for (number, (words, edit)) in wrong.into_iter().enumerate() {
        let found = warnings(edit);
        assert!(found.iter().any(|one| one.contains(words)), "{number} {words}: {found:?}");
        assert!(found.iter().all(|one| one.contains("--truth")), "{found:?}");
    }
}

//! `pocketsplat sweep`: killed, gone on with, extended, contradicted.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::fixture::{capture, fails, folder, pocketsplat, starts, succeeds, wait_for};

fn sweep(output: &Path, lambdas: &str, iterations: u32) -> Command {
    let mut command = pocketsplat();
    command.arg("sweep").arg(capture()).arg("-o").arg(output).args(["--lambda", lambdas]);
    command.args(["--iterations", &iterations.to_string(), "--feature-dim", "8", "--offsets", "3"]);
    command.args(["--checkpoint-every", "20"]);
    command
}

#[test]
fn a_sweep_goes_on_where_it_was_stopped_and_trains_nothing_twice() {
    let home = folder("sweep");
    let first = home.join("lambda-0.004.run");
    let mut child = starts(&mut sweep(&home, "0.004,0.001", 80));
    wait_for(&first, 45, &mut child);
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!home.join("results.csv").exists(), "no point is done");

    let said = succeeds(&mut sweep(&home, "0.004,0.001", 80));
    assert!(said.contains("going on after iteration "), "{said}");
    assert!(!said.contains("trained before"), "{said}");
    let results = fs::read_to_string(home.join("results.csv")).unwrap();
    let rows: Vec<&str> = results.lines().collect();
    assert_eq!(rows[0], "Submethod,PSNR,SSIM,LPIPS,Size [Bytes],#Gaussians,program");
    assert_eq!(rows.len(), 3, "{results}");
    for (row, lambda) in rows[1..].iter().zip(["0.004", "0.001"]) {
        let cells: Vec<&str> = row.split(',').collect();
        let bytes = fs::metadata(home.join(format!("lambda-{lambda}.psb"))).unwrap().len();
        assert_eq!((cells[0], cells[4]), (&*format!("lambda={lambda}"), &*bytes.to_string()), "{row}");
        assert!(cells[1].parse::<f64>().unwrap() > 10.0 && cells[3].is_empty(), "no LPIPS without weights: {row}");
    }

    let said = succeeds(&mut sweep(&home, "0.004,0.002,0.001", 80));
    assert_eq!(said.matches("trained before").count(), 2, "{said}");
    let longer = fs::read_to_string(home.join("results.csv")).unwrap();
    assert_eq!(longer.lines().count(), 4);
    assert!(rows.iter().all(|row| longer.lines().any(|line| line == *row)), "{longer} has what was there: {results}");
    let figure = fs::read_to_string(home.join("rate_distortion.svg")).unwrap();
    // A marker for each rate, and one in the legend; names stand where there is room.
    assert!(figure.matches("<circle").count() == 4 && figure.contains("λ 0.001"), "{figure}");

    let error = fails(&mut sweep(&home, "0.004", 81));
    assert!(
        error.contains("`train.iterations` is 80 in the run, 81 on the command line")
            && error.contains("lambda-0.004.run"),
        "{error}"
    );
}

#[test]
fn weights_that_no_sweep_can_use_are_refused_before_any_work() {
    let home = folder("bad-sweep");
    let error = fails(&mut sweep(&home, "0.004,0.004", 80));
    assert!(error.contains("0.004 twice"), "{error}");
    let error = fails(&mut sweep(&home, "0.004,-1", 80));
    assert!(error.contains("lambda") && error.contains("-1"), "{error}");
    assert!(fs::read_dir(&home).unwrap().next().is_none(), "nothing was begun");
    let error = fails(sweep(&home, "0.004", 80).args(["--backbone", "scaffold"]));
    assert!(error.contains("--backbone hac"), "{error}");
}

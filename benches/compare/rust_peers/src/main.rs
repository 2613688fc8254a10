//! Rust libraries as a program that answers requests, like `compare_ours`: `rust_peers LIBRARY`.
//!
//! - a request is a line on standard input, `operation key=value key=value ..`;
//! - the answer is a line on standard output, `ok wall_seconds cpu_seconds` or `error message`;
//! - with `result=PATH` in the request, the result is written to that file after the time is measured.

mod factrs_peer;
mod g2o;
mod request;
mod solved;
mod timing;
mod tiny_solver_peer;

use std::error::Error;
use std::io::{BufRead, Write, stdin, stdout};
use std::panic::{AssertUnwindSafe, catch_unwind};

use request::Request;
use solved::Solved;
use timing::Timing;

/// Any error is reported to the script as text.
type Failure = Box<dyn Error>;

/// The function with which a library solves the pose graph of a request.
type Solver = fn(&Request) -> Result<(Solved, Timing), Failure>;

fn answer(solver: Solver, line: &str) -> Result<Timing, Failure> {
    let request = Request::parse(line)?;
    if request.operation != "pose_graph" {
        return Err(format!("no operation {}", request.operation).into());
    }
    // A library may panic when its equations cannot be solved.
    let (solved, timing) = catch_unwind(AssertUnwindSafe(|| solver(&request))).map_err(|panic| {
        panic.downcast_ref::<String>().cloned().unwrap_or_else(|| "it panicked".to_owned())
    })??;
    if let Ok(path) = request.text("result") {
        solved.write(path)?;
    }
    Ok(timing)
}

fn main() -> Result<(), Failure> {
    let solver: Solver = match std::env::args().nth(1).as_deref() {
        Some("factrs") => factrs_peer::solve,
        Some("tiny-solver") => tiny_solver_peer::solve,
        other => return Err(format!("no library {other:?}").into()),
    };
    for line in stdin().lock().lines() {
        let reply = match answer(solver, &line?) {
            Ok(Timing { wall, cpu }) => format!("ok {:.9} {:.9}", wall.as_secs_f64(), cpu.as_secs_f64()),
            Err(failure) => format!("error {}", failure.to_string().replace('\n', " ")),
        };
        let mut out = stdout().lock();
        writeln!(out, "{reply}")?;
        out.flush()?;
    }
    Ok(())
}

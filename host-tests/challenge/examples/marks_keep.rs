//! Keeps recordings of the marks' trials: for study, without a diagnosis.
use std::path::Path;
use rlg_challenge::marks::run::{Plan, prepare};
use rlg_challenge::marks::trial::Family;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    use Family::*;
    let positive = args[1] == "positive";
    let fams: Vec<Family> = if positive { vec![Basic, Single, Pair, DriftBasic] } else { vec![Null, Drift, WeakDrift] };
    let mut plan = Plan::new(args[2].parse().unwrap(), args[3].parse().unwrap(), &fams);
    plan.most_rows = args[5].parse().unwrap();
    let t = std::time::Instant::now();
    let p = prepare(&plan, &|| {}).unwrap();
    eprintln!("prepared {:.1}", t.elapsed().as_secs_f64());
    p.diagnose(plan.seed, None, Some(Path::new(&args[4])), &|| {}).unwrap();
    eprintln!("kept {:.1}", t.elapsed().as_secs_f64());
}

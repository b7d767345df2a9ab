//! `report.html`: required and forbidden content of the page.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use rlg::diagnose::locate::Tile;
use rlg::diagnose::pictures::Pictures;
use rlg::diagnose::result::*;
use rlg::report::{figure, page};
use serde_json::Value;

/// Largest size of a page: it is sent as an attachment and opened on a phone.
const LARGEST_PAGE_BYTES: usize = 1_500_000;

/// Largest size of a picture in a page on the web.
const LARGEST_PICTURE_BYTES: usize = 60_000;

/// Text that would run if it were not escaped.
const HOSTILE: &str = "<script>alert('1')</script><img src=x onerror=\"x()\">&amp;";

/// Scripts allowed in the page: the plots' numbers, the drawing library, our own.
const SCRIPTS: [&str; 3] = [
    "<script type=\"application/json\" id=\"charts\">",
    concat!(
        "<script>",
        include_str!("../../../report/vendor/uplot/uPlot.iife.min.js"),
        "</script>"
    ),
    concat!(
        "<script>",
        include_str!("../../../report/src/page.js"),
        "</script>"
    ),
];

/// Returns a page without the allowed scripts.
fn without_scripts(page: &str) -> String {
    SCRIPTS.iter().fold(page.to_owned(), |page, script| {
        assert_eq!(page.matches(script).count(), 1, "{script:.60} stands once");
        page.replace(script, "")
    })
}

#[test]
fn the_page_takes_nothing_from_outside_and_runs_its_own_scripts_only() {
    let page = page(&explained(), Some(&pictures(60.0)));
    let (_, policy) = page
        .split_once("Content-Security-Policy\" content=\"")
        .expect("a policy");
    let (policy, _) = policy.split_once('"').expect("its end");
    assert!(
        policy.starts_with("default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-")
    );
    assert_eq!(policy.matches("sha256-").count(), 2, "{policy}");
    let page = without_scripts(&page);
    for forbidden in [
        "http:", "https:", "<script", "<link", "<iframe", "<img", "src=", "href=", "url(",
        "@import", "onload=", "onerror=",
    ] {
        assert!(!page.contains(forbidden), "the page has {forbidden}");
    }
}

#[test]
fn findings_stand_on_the_page_as_people_read_them() {
    let page = page(&explained(), Some(&pictures(60.0)));
    for expected in [
        "bench-17: Explained",
        "axis_flexure",
        "cubic axis flexure",
        // 1.42e-7 ± 4.1e-9 s², to two digits of the standard deviation
        "142.0 ± 4.1",
        "xy + xz",
        "value ± σ [10⁻⁹ s²]",
        // 6.9633e-6 and 1.4069e-7 ± 2.7506e-7 rad/s, times 206265 °/h in a rad/s
        "1.436 ± 0.057",
        "0.029 ± 0.057",
        "10⁻⁴¹",
        "Explains 34.2 % of the power",
        "cross-validated over blocks of rows, the log score rises by 71.3",
        "Simulated 8 times without it (parametric bootstrap), its squared estimate is 1.13 σ² per parameter",
        "ω<sub>z</sub>",
        "δ<sub>ij</sub>",
        "coning-x",
        "0.999 ± 0.027",
        "Spin about one axis",
        "gyro bias by temperature",
        "no temperature channels",
        "reference_delay fits in part",
        "0.002022",
        "319 hypotheses",
        "15.9–21.0 s",
        "(coherence 0.987, 2.5 ms late, chance 10⁻⁷)",
        // 31 and 30 of 42
        "it found 74 % and named correctly 71 %",
        "gyro scale in 1",
        "below 2.3 % with 95 % confidence",
    ] {
        assert!(page.contains(expected), "the page lacks {expected}");
    }
}

#[test]
fn every_number_of_the_json_stands_on_the_page() {
    let diagnosis = explained();
    let page = page(&diagnosis, None);
    let json = serde_json::to_value(&diagnosis).expect("numbers and text have a JSON form");
    let mut numbers = Vec::new();
    collect(&json, &mut numbers);
    assert!(numbers.len() > 60, "only {} numbers", numbers.len());
    let (_, data) = page.split_once("<pre>").expect("the data end the page");
    for number in numbers {
        assert!(data.contains(&number), "the page lacks {number}");
    }
}

#[test]
fn evidence_against_a_kind_that_the_recording_does_not_excite_is_not_told_as_evidence() {
    let mut diagnosis = explained();
    let weak = Sensitivity {
        kind: "isolator_mode".to_owned(),
        typical: 1.0,
        unit: "1".to_owned(),
        snr: 0.4,
        snr_weakest: 0.3,
    };
    diagnosis.sensitivity.push(weak);
    diagnosis.runners_up.push(RunnerUp {
        kind: "isolator_mode".to_owned(),
        behind: 2000.0,
    });
    diagnosis.runners_up.push(RunnerUp {
        kind: "lock_in".to_owned(),
        behind: 321.0,
    });
    let page = page(&diagnosis, None);
    let (_, rest) = page
        .split_once("<b>Disfavoured</b>")
        .expect("kinds that the recording speaks against");
    let (disfavoured, rest) = rest.split_once("</p>").expect("its end");
    assert!(
        disfavoured.contains("lock-in (321)") && !disfavoured.contains("isolator"),
        "{disfavoured}"
    );
    let (_, not_excited) = rest
        .split_once("Not excited here")
        .expect("kinds of which it says nothing");
    assert!(not_excited.contains("isolator resonance</b> (0.4)"));
}

#[test]
fn hostile_names_are_text() {
    let mut diagnosis = explained();
    diagnosis.recording = HOSTILE.to_string();
    diagnosis.summary[0] = HOSTILE.to_string();
    diagnosis.locations[0].channel = HOSTILE.to_string();
    diagnosis.locations[0].regime = HOSTILE.to_string();
    diagnosis.effects[0].regimes[0].name = HOSTILE.to_string();
    diagnosis.effects[0].expression = Some(HOSTILE.to_string());
    diagnosis.effects[0].equation = HOSTILE.to_string();
    diagnosis.next_experiment = HOSTILE.to_string();
    diagnosis.not_excluded.push(HOSTILE.to_string());
    let page = without_scripts(&page(&diagnosis, Some(&pictures(60.0))));
    for tag in ["<script", "<img", "alert('1')</script>"] {
        assert!(!page.contains(tag), "{tag} is not escaped");
    }
    assert!(
        page.contains("&lt;script&gt;"),
        "the name is not shown at all"
    );
}

#[test]
fn the_same_diagnosis_gives_the_same_bytes() {
    let first = page(&explained(), Some(&pictures(60.0)));
    assert_eq!(first, page(&explained(), Some(&pictures(60.0))));
}

#[test]
fn accelerometers_stand_in_the_same_tables_in_their_own_units() {
    let mut diagnosis = explained();
    let mut force = diagnosis.fit.channels[0].clone();
    force.channel = "accel_x".to_string();
    force.unit = Some("m/s^2");
    force.held_out_before.drift_rad_s = 9.80665e-4;
    force.held_out_before.drift_std_rad_s = 2.0 * 9.80665e-6;
    diagnosis.fit.channels.push(force);
    diagnosis.accelerometer_noise.push(ForceNoiseEntry {
        channel: "accel_x".to_string(),
        noise_m_s2_sqrt_hz: 9.80665e-5,
        velocity_noise_m_s: 1e-8,
        terms: None,
    });
    let page = page(&diagnosis, None);
    // A millionth of standard gravity is 9.80665e-6 m/s².
    assert!(page.contains("accel x [µg]") && page.contains("100.0 ± 2.0"));
    assert!(page.contains("µg/√Hz"));
    assert!(page.contains("°/h"), "the gyros keep their unit");
}

#[test]
fn an_unusable_recording_has_a_page_without_pictures() {
    let diagnosis = Diagnosis {
        verdict: Verdict::Unusable,
        summary: vec!["Nothing can be said: too short.".to_string()],
        locations: Vec::new(),
        effects: Vec::new(),
        fit: FitEntry {
            recordings: Vec::new(),
            whole: None,
            fitted_on: Vec::new(),
            held_out: Vec::new(),
            channels: Vec::new(),
        },
        noise: Vec::new(),
        runners_up: Vec::new(),
        sensitivity: Vec::new(),
        control: None,
        self_test: None,
        not_excluded: vec!["every kind: too short".to_string()],
        ..explained()
    };
    let page = page(&diagnosis, None);
    assert!(page.contains("Unusable") && page.contains("Nothing can be said: too short."));
    assert!(page.contains("every kind"));
    assert!(!page.contains("<svg"), "there is nothing to draw");
    assert!(!page.contains("Effects found"), "nothing was found");
}

#[test]
fn a_matching_recording_says_how_sensitive_it_was_and_claims_no_before_and_after() {
    let diagnosis = Diagnosis {
        verdict: Verdict::Matches,
        summary: vec!["The model explains this recording.".to_string()],
        locations: Vec::new(),
        effects: Vec::new(),
        ..explained()
    };
    let page = page(&diagnosis, Some(&pictures(60.0)));
    assert!(page.contains("Sensitivity of this recording"));
    // typical 1e-7 s² at SNR 29.83 and 4.1, and 7 needed
    assert!(page.contains("23 to 170 × 10⁻⁹ s²"));
    let (told, _) = page.split_once("<pre>").expect("the data end the page");
    for claim in [
        "the model as it was",
        "Effects found",
        "Before and after",
        "instead of a finding above",
    ] {
        assert!(
            !told.contains(claim),
            "a page that found nothing says {claim}"
        );
    }
}

#[test]
fn every_plot_scales_with_the_page_and_says_what_it_shows() {
    let page = page(&explained(), Some(&pictures(60.0)));
    let plots: Vec<&str> = page.split("<svg").skip(1).collect();
    // two maps and two curves a gyro, besides the small marks
    assert!(plots.len() > 12);
    for plot in plots {
        let tag = plot.split('>').next().unwrap_or_default();
        assert!(tag.contains("viewBox="), "no viewBox in {tag}");
        assert!(!tag.contains(" width="), "fixed width in {tag}");
        assert!(
            tag.contains("aria-label=") || tag.contains("aria-hidden="),
            "{tag} says nothing to whoever cannot see it"
        );
    }
}

#[test]
fn the_page_of_an_hour_stays_small() {
    let mut diagnosis = explained();
    let regime = diagnosis.effects[0].regimes[0].clone();
    diagnosis.effects[0].regimes = (0..720)
        .map(|k| RegimeEntry {
            name: format!("{} to {} s", 5 * k, 5 * k + 5),
            ..regime.clone()
        })
        .collect();
    let page = page(&diagnosis, Some(&pictures(3600.0)));
    assert!(page.len() < LARGEST_PAGE_BYTES, "{} bytes", page.len());
    assert!(page.contains("of 720"), "what is not shown is not said");
}

#[test]
fn numbers_that_are_not_known_do_not_break_a_page() {
    let mut diagnosis = explained();
    diagnosis.effects[0].identifiable[0].std = 0.0;
    diagnosis.effects[0].regimes[0].std = f64::NAN;
    diagnosis.fit.channels[0].held_out_after.drift_rad_s = f64::NAN;
    diagnosis.fit.channels[0].held_out_after.drift_std_rad_s = f64::INFINITY;
    let mut pictures = pictures(60.0);
    pictures.angle_after_rad[0] = vec![f64::NAN; pictures.time_s.len()];
    pictures.power_after[1] = vec![0.0; pictures.frequency_hz.len()];
    let page = page(&diagnosis, Some(&pictures));
    assert!(page.contains("not known"));
    assert!(!page.contains("could not be drawn"));
}

#[test]
fn the_residual_picture_stands_alone_and_says_what_fell() {
    let svg = figure::residuals(&explained(), Some(&pictures(60.0)));
    assert!(svg.len() < LARGEST_PICTURE_BYTES, "{} bytes", svg.len());
    assert!(svg.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" width="));
    for expected in [
        "fill=\"#FFFFFF\"",
        "aria-label=",
        "time [s]",
        "residual [″]",
        "after: with axis flexure",
        "held out of the fit",
        // 6.9633e-6 and 1.4069e-7 ± 2.7506e-7 rad/s, times 206265 °/h in a rad/s
        "gyro x: mean residual rate on held-out time 1.436 ± 0.057 °/h before, 0.029 ± 0.057 °/h after",
        "gyro z: ",
    ] {
        assert!(svg.contains(expected), "the picture lacks {expected}");
    }
    for forbidden in ["bench-17", "<script", "href=", "url(", "NaN", "inf"] {
        assert!(!svg.contains(forbidden), "the picture has {forbidden}");
    }
}

#[test]
fn a_picture_of_nothing_found_claims_no_before_and_after() {
    let diagnosis = Diagnosis {
        verdict: Verdict::Matches,
        effects: Vec::new(),
        ..explained()
    };
    let svg = figure::residuals(&diagnosis, Some(&pictures(60.0)));
    assert!(svg.contains("model as given"));
    assert!(!svg.contains("before") && !svg.contains("after"));
    let nothing = figure::residuals(&diagnosis, None);
    assert!(nothing.contains("No residual to draw"));
}

fn collect(value: &Value, numbers: &mut Vec<String>) {
    match value {
        Value::Number(number) => numbers.push(number.to_string()),
        Value::Array(list) => list.iter().for_each(|item| collect(item, numbers)),
        Value::Object(map) => map.values().for_each(|item| collect(item, numbers)),
        Value::Null | Value::Bool(_) | Value::String(_) => {}
    }
}

/// Makes a diagnosis with numbers like those of a real coning recording.
pub(super) fn explained() -> Diagnosis {
    let parameter = |name: &str, value: f64| ParameterEntry::Number {
        name: name.to_string(),
        value,
        std: 9.135e-9,
        unit: "s^2".to_string(),
    };
    let fixed = |second: f64, value: f64, std: f64| Identifiable {
        combination: BTreeMap::from([("xy".to_string(), 1.0), ("xz".to_string(), second)]),
        value,
        std,
    };
    let figures = |drift_rad_s: f64, white_p_value: f64| FiguresEntry {
        drift_rad_s,
        drift_std_rad_s: 2.7506e-7,
        normalised_power: 1.1838,
        normalised_power_all: 1.0045,
        white_p_value,
    };
    Diagnosis {
        format: 1,
        recording: "bench-17".to_string(),
        version: "0.1.0".to_string(),
        seed: 5,
        verdict: Verdict::Explained,
        summary: vec![
            "The recording differs from its model; the effects found explain it.".to_string(),
            "Rejected: reference_delay fits in part, but not in every regime.".to_string(),
        ],
        locations: vec![LocationEntry {
            recording: None,
            channel: "gyro_x".to_string(),
            start_s: 4.0,
            end_s: 21.0,
            low_hz: 0.0,
            high_hz: 1.0,
            regime: "grows as omega_z*alpha_y".to_string(),
            size: 9.7688e-6,
            unit: "rad/s".to_string(),
            p_value: 2.367e-160,
            coherent_with: vec![CoherentEntry {
                channel: "gyro_x".to_string(),
                with: "alpha_y*omega_z".to_string(),
                lag_s: 0.0025,
                coherence: 0.9871,
                p_value: 1.2e-7,
            }],
        }],
        effects: vec![EffectEntry {
            evidence: Some(EvidenceEntry {
                label: "class",
                confirmed_gain: 71.26,
                share: 0.3417,
                reenactments: 8,
                inflation: 1.134,
            }),
            gravity_speaks_against: Vec::new(),
            kind: "axis_flexure".to_string(),
            indistinguishable_from: vec!["axis_flexure_cubic".to_string()],
            equation: "delta_ij = -K_ij alpha_j".to_string(),
            parameters: vec![parameter("xy", 7.7244e-8), parameter("xz", 6.4767e-8)],
            covariance: vec![vec![8.3455e-17, -7.5011e-17], vec![-7.5011e-17, 8.3498e-17]],
            identifiable: vec![
                fixed(1.0, 1.4201e-7, 4.1148e-9),
                fixed(-1.0, 1.2477e-8, 1.7804e-8),
            ],
            log_evidence_gain: 1858.67,
            p_value: 0.0,
            what_was_left_out: "The dither suspension is not stiff.".to_string(),
            expression: None,
            regimes: vec![RegimeEntry {
                name: "coning-x".to_string(),
                amplitude: 0.99939,
                std: 0.02701,
            }],
        }],
        fit: FitEntry {
            recordings: Vec::new(),
            whole: None,
            fitted_on: vec![[0.00225, 2.80075], [4.0, 15.9]],
            held_out: vec![[15.9, 21.0]],
            channels: ["gyro_x", "gyro_y", "gyro_z"]
                .map(|channel| ChannelEntry {
                    channel: channel.to_string(),
                    unit: None,
                    band_hz: [0.0, 315.85],
                    held_out_before: figures(6.9634e-6, 1.018e-41),
                    held_out_after: figures(1.4069e-7, 0.8885),
                })
                .into(),
        },
        not_excluded: vec!["gyro_bias_temperature: no temperature channels".to_string()],
        registration: Vec::new(),
        experiment: None,
        next_experiment: "Spin about one axis while oscillating about a second.".to_string(),
        residual: Some(ResidualEntry {
            share_of_motion: 2.34e-4,
            coherence: vec![CoherenceEntry {
                low_hz: 12.5,
                high_hz: 25.0,
                gyros: [0.98, 0.99, 0.75],
            }],
        }),
        noise: vec![NoiseEntry {
            channel: "gyro_x".to_string(),
            // × 180/π × 60 = 0.002022 °/√h
            angle_random_walk_rad_sqrt_s: 5.8828e-7,
            angle_noise_rad: 6.9927e-7,
            wandering_rad_s: None,
            terms: None,
        }],
        accelerometer_noise: Vec::new(),
        trials: 319,
        runners_up: vec![RunnerUp {
            kind: "axis_flexure_cubic".to_string(),
            behind: 2.336,
        }],
        sensitivity: vec![Sensitivity {
            kind: "axis_flexure".to_string(),
            typical: 1e-7,
            unit: "s^2".to_string(),
            snr: 29.834,
            snr_weakest: 4.1,
        }],
        control: None,
        plan: Vec::new(),
        self_test: Some(SelfTestEntry {
            slides: 200,
            false_names: 1,
            upper_limit_95: 0.023_4,
            curve: [(4.0, 3, 0.14), (6.0, 31, 0.78), (8.0, 40, 0.996)]
                .map(|(rho, detected, theory)| SelfTestPoint {
                    rho,
                    injections: 42,
                    detected,
                    named: detected - 1,
                    theory,
                })
                .into(),
            kinds: vec![SelfTestKind {
                kind: "gyro_scale".to_string(),
                false_names: 1,
                detected: vec![Some(0), Some(2), None],
                named: vec![Some(0), Some(2), None],
            }],
        }),
    }
}

/// Makes the series of a recording of `seconds`, decimated as in the diagnosis.
pub(super) fn pictures(seconds: f64) -> Pictures {
    let (points, rate_hz) = (1500, 4000.0);
    let time_s: Vec<f64> = (0..points)
        .map(|k| seconds * f64::from(k) / f64::from(points))
        .collect();
    let frequency_hz: Vec<f64> = (0..100)
        .map(|k| 0.1 * 10f64.powf(0.043 * f64::from(k)))
        .collect();
    let triad = |value: &dyn Fn(f64) -> f64, at: &[f64]| {
        [1.0, 2.0, 3.0].map(|gyro: f64| at.iter().map(|x| gyro * value(*x)).collect::<Vec<f64>>())
    };
    let edges = [0.0, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 600.0, 2000.0];
    let rows = (6.0 * rate_hz) as usize;
    let mut tiles = Vec::new();
    for piece in 0..(seconds / 6.0) as usize {
        for (band, edge) in edges.windows(2).enumerate() {
            tiles.extend([0, 1, 2].map(|axis| Tile {
                axis,
                rows: piece * rows..(piece + 1) * rows,
                band_hz: (edge[0], edge[1]),
                power: 1.0,
                mean_rad_s: 0.0,
                mean_std_rad_s: 1e-7,
                excess_rad_s: 0.0,
                chance: if band == 0 { 1e-40 } else { 0.5 },
            }));
        }
    }
    Pictures {
        angle_before_rad: triad(&|t| 1e-6 * t, &time_s),
        angle_after_rad: triad(&|t| 1e-6 * (TAU * t).sin(), &time_s),
        power_before: triad(&|f| 1e-12 * (1.0 + f), &frequency_hz),
        power_after: triad(&|f| 1e-13 * (1.0 + f), &frequency_hz),
        power_noise: triad(&|f| 1.1e-13 * (1.0 + f), &frequency_hz),
        time_s,
        frequency_hz,
        tiles_before: tiles.clone(),
        tiles_after: tiles,
        significance: 1e-4,
        held_out_s: vec![[0.7 * seconds, seconds]],
        rate_hz,
        start_s: 0.0,
    }
}

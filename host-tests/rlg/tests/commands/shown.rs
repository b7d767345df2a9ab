//! The answer's words and picture, on the terminal and on the page, of diagnoses made here.

use rlg::diagnose::result::*;
use rlg::report::page;
use rlg::report::terminal::{lines, picture};

use super::report::{explained, pictures};

/// The difference of the two is 0.7 σ from zero: it is named and not listed, on the terminal and on the page; the page's data
/// have it.
#[test]
fn a_value_below_three_sigma_is_not_listed_beside_those_that_are_found() {
    let diagnosis = explained();
    let said = lines(&diagnosis, None).join("\n");
    assert!(
        said.contains("axis flexure xy + xz   142.0 ± 4.1 in 10⁻⁹ s²; xy − xz below 3 σ"),
        "{said}"
    );
    let page = page(&diagnosis, None);
    let (shown, data) = page.split_once("All numbers").expect("the data");
    assert!(
        shown.contains("xy − xz below 3 σ.") && !shown.contains("12 ± 18"),
        "{shown}"
    );
    assert!(data.contains("1.2477e-8"), "{data}");
}

/// Many places of one fault are one line, on the page too; rows that no gyro has are the recording's.
#[test]
fn lost_rows_are_rows_of_the_recording_and_one_line() {
    let fault = |row: f64, owner: Option<&str>| {
        let number = |name: &str, value: f64| ParameterEntry::Number {
            name: name.to_string(),
            value,
            std: 0.01,
            unit: "s".to_string(),
        };
        let text = |name: &str, value: &str| ParameterEntry::Text {
            name: name.to_string(),
            value: value.to_string(),
        };
        let mut parameters = vec![
            text("channel", "gyro_x"),
            number("start_s", 0.01 * row),
            number("end_s", 0.01 * (row + 50.0)),
        ];
        parameters.extend(owner.map(|owner| text("rows_of", owner)));
        EffectEntry {
            kind: "lost_samples".to_string(),
            parameters,
            evidence: None,
            ..explained().effects.remove(0)
        }
    };
    let of = |effects: Vec<EffectEntry>| Diagnosis {
        effects,
        ..explained()
    };
    let recording = Some("the recording");
    let said = lines(&of(vec![fault(1500.0, recording)]), None).join("\n");
    assert!(
        said.contains("lost rows   50 rows of the recording, 15.0–15.5 s"),
        "{said}"
    );
    let both = of(vec![
        fault(300.0, recording),
        fault(1500.0, recording),
        fault(700.0, None),
    ]);
    let line = "100 rows of the recording in 2 places, 3.0–15.5 s; gyro x: 50 rows, 7.0–7.5 s";
    let said = lines(&both, None).join("\n");
    assert!(said.contains(line), "{said}");
    let page = page(&both, None);
    assert!(page.contains(&format!("<b>lost rows</b> {line}")), "{page}");
    assert_eq!(page.matches("<td>the recording</td>").count(), 2, "{page}");
}

#[test]
fn power_below_that_of_noise_alone_is_said_beside_the_figures() {
    let mut diagnosis = explained();
    diagnosis.fit.channels[1].held_out_after.normalised_power = 0.3;
    let quiet = "the held-out time of gyro y is quieter than the fitted";
    let said = lines(&diagnosis, None).join("\n");
    assert!(
        said.contains(&format!("(1 = noise alone: {quiet})")),
        "{said}"
    );
    assert!(page(&diagnosis, None).contains(&format!("Below 0.5: {quiet}.")));
}

/// Before, the residual of gyro x rises to 60 µrad, and after it is a sine of 1 µrad, at the scale of the first.
#[test]
fn the_picture_shows_the_gyros_with_a_finding_before_and_after() {
    let mut diagnosis = explained();
    let series = pictures(60.0);
    for width in [50, 80, 200] {
        let drawn = picture(&diagnosis, Some(&series), width);
        assert_eq!(drawn.len(), 9, "gyro x alone: {drawn:#?}");
        assert_eq!(drawn[0], "gyro x: integrated residual [″], 0.0–60.0 s");
        assert!(
            drawn.iter().all(|line| line.chars().count() <= width),
            "{drawn:#?}"
        );
        let dots = |line: &String| {
            let dots = line
                .chars()
                .filter(|dot| matches!(dot, '\u{2801}'..='\u{28FF}'));
            dots.count()
        };
        let [before, after] = [1, 5].map(|first| [0, 1, 2, 3].map(|row| dots(&drawn[first + row])));
        // Of the 15 steps between 16 dots the ends of the axis have half a one less, and the sine goes 0.25 below zero.
        let columns = (width - 8) as f64;
        for (count, steps) in before.iter().zip([3.5, 4.0, 4.0, 3.25]) {
            let expected = columns * steps / 15.0;
            assert!((*count as f64 - expected).abs() <= 2.0, "{before:?}");
        }
        assert_eq!(after[..3], [0, 0, 0], "{drawn:#?}");
        assert!(after[3] > width / 2, "{after:?}");
        assert!(
            drawn[1].starts_with("    12 ┤")
                && drawn[2].starts_with("before ┤")
                && drawn[8].starts_with(" −0.21 ┤"),
            "{drawn:#?}"
        );
    }
    diagnosis.effects.clear();
    diagnosis.locations.clear();
    let all = picture(&diagnosis, Some(&series), 80);
    assert_eq!(
        all.len(),
        15,
        "nothing is found, so all three, once each: {all:#?}"
    );
    let none = picture(&diagnosis, None, 80);
    assert!(
        none.len() == 1 && none[0].starts_with("No residual to draw"),
        "{none:?}"
    );
}

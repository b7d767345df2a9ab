//! `report.html` in a headless Chromium: properties that only a browser can test.

use std::fs;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use rlg::recording::{Channel, Clock, Quantity, Recording, Table};
use rlg::report::beside::{Beside, rates};
use rlg::report::page_beside;
use serde_json::json;

use super::browser::Browser;
use super::report::{explained, pictures};

/// ″ in one rad.
const ARCSEC: f64 = 180.0 * 3600.0 / std::f64::consts::PI;

/// Relative rounding of numbers on the page: six digits are kept.
const ROUNDED: f64 = 1e-6;

/// Makes a minute at 100 Hz of oscillating gyros.
fn swinging() -> Recording {
    let values = (0..6000)
        .map(|row| 0.1 * (f64::from(row) / 40.0).sin())
        .collect::<Vec<f64>>();
    let channels = ["x", "y", "z"].map(|axis| Channel {
        column: format!("g{axis}"),
        quantity: Quantity::GyroRate,
        axis: Some(axis.to_owned()),
        scale: 1.0,
        offset: 0.0,
        values: values.clone(),
    });
    Recording {
        name: "swinging".to_owned(),
        folder: PathBuf::new(),
        site: None,
        tables: vec![Table {
            file: "samples.csv".to_owned(),
            clock: Clock::Uniform {
                rate_hz: 100.0,
                start_s: 0.0,
            },
            rows: 6000,
            channels: channels.into(),
        }],
        segments: Vec::new(),
    }
}

fn write_page(browser: &Browser) -> PathBuf {
    let beside = Beside {
        provenance: vec![
            ("recording", "bench-17".to_owned()),
            ("model", "model.toml".to_owned()),
        ],
        rates: rates(&swinging(), [0.0; 3]),
        ..Beside::default()
    };
    let file = browser.folder().join("report.html");
    let page = page_beside(&explained(), Some(&pictures(60.0)), &beside);
    fs::write(&file, page).expect("a temporary folder");
    file
}

/// Returns the middle half of a plot: left, right, and its height's middle.
fn middle_of(browser: &mut Browser, id: &str) -> [f64; 3] {
    let place = browser.value(&format!(
        "(() => {{ const plot = document.querySelector('[data-chart={id}] .u-over'); plot.scrollIntoView({{ block: 'center' }});
         const box = plot.getBoundingClientRect(); return [box.left + box.width / 4, box.left + box.width * 3 / 4, box.top + box.height / 2]; }})()"
    ));
    let number = |index: usize| place[index].as_f64().expect("a place");
    [number(0), number(1), number(2)]
}

/// Returns the canvas of a plot, once it has been drawn again.
fn drawn(browser: &mut Browser, id: &str) -> String {
    let canvas = format!(
        "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() =>
         done(document.querySelector('[data-chart={id}] canvas').toDataURL()))))"
    );
    let shown = browser.value(&canvas);
    shown.as_str().expect("a picture").to_owned()
}

#[test]
#[ignore = "needs Chromium, which cargo verify installs: --test commands -- --ignored in_a_browser"]
fn plots_zoom_together_and_come_back_in_a_browser() {
    let mut browser = Browser::start(1200);
    let page = write_page(&browser);
    browser.open(&page);
    let linked = ["residual-angle-x", "residual-angle-z", "rate-y"];
    let whole = linked.map(|id| drawn(&mut browser, id));
    let other = drawn(&mut browser, "residual-spectrum-x");

    let [left, right, height] = middle_of(&mut browser, "residual-angle-x");
    browser.drag((left, height), (right, height), 1, 0);
    let zoomed = linked.map(|id| drawn(&mut browser, id));
    for (id, (before, after)) in linked.iter().zip(whole.iter().zip(&zoomed)) {
        assert!(before != after, "{id} shows the same after a zoom");
    }
    assert_eq!(
        other,
        drawn(&mut browser, "residual-spectrum-x"),
        "another axis has moved"
    );

    // With the shift key the same movement moves the plots.
    let shift = 8;
    browser.drag((right, height), (left, height), 1, shift);
    let moved = linked.map(|id| drawn(&mut browser, id));
    assert!(
        moved.iter().zip(&zoomed).all(|(one, other)| one != other),
        "nothing moved"
    );

    browser
        .value("[...document.querySelectorAll('.tools[data-group=time] button')].at(-1).click()");
    let again = linked.map(|id| drawn(&mut browser, id));
    assert!(again == whole, "the whole is not what it was");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

/// Returns the file saved by a plot's button.
fn saved(browser: &mut Browser, id: &str) -> String {
    let button = format!("document.querySelector('[data-chart={id}] button.csv').click()");
    browser.value(&button);
    let file = browser.folder().join(format!("{id}.csv"));
    let begun = Instant::now();
    loop {
        match fs::read_to_string(&file) {
            Ok(text) if !text.is_empty() => return text,
            _ if begun.elapsed() > Duration::from_secs(20) => panic!("{id}: nothing was saved"),
            _ => std::thread::sleep(Duration::from_millis(50)),
        }
    }
}

#[test]
#[ignore = "needs Chromium, which cargo verify installs: --test commands -- --ignored in_a_browser"]
fn the_saved_numbers_are_those_of_the_plot_in_a_browser() {
    let mut browser = Browser::start(1200);
    let page = write_page(&browser);
    browser.open(&page);
    let buttons = browser.value("document.querySelectorAll('figure.chart button.csv').length");
    assert_eq!(
        buttons,
        json!(19),
        "three plots each of angle, spectrum, Allan deviation and rate, six maps, a self-test"
    );
    let text = saved(&mut browser, "residual-angle-y");
    let pictures = pictures(60.0);
    let (head, rows) = text.split_once('\n').expect("a head");
    let names = "time [s],before: the model as given: residual angle [″],after: with the effects found: residual angle [″]";
    assert_eq!(head, names);
    let rows: Vec<Vec<f64>> = rows
        .lines()
        .map(|row| {
            row.split(',')
                .map(|cell| cell.parse().expect("a number"))
                .collect()
        })
        .collect();
    assert_eq!(rows.len(), pictures.time_s.len());
    for (row, cells) in rows.iter().enumerate() {
        let expected = [
            pictures.time_s[row],
            pictures.angle_before_rad[1][row] * ARCSEC,
            pictures.angle_after_rad[1][row] * ARCSEC,
        ];
        for (cell, expected) in cells.iter().zip(expected) {
            assert!(
                (cell - expected).abs() <= ROUNDED * expected.abs(),
                "row {row}: {cell}, not {expected}"
            );
        }
    }
    let map = saved(&mut browser, "map-z-after");
    let (head, cells) = map.split_once('\n').expect("a head");
    assert!(
        head.starts_with("begin [s],end [s],band from [Hz]"),
        "{head}"
    );
    let tiles = pictures.tiles_after.iter().filter(|tile| tile.axis == 2);
    assert_eq!(cells.lines().count(), tiles.count());
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
#[ignore = "needs Chromium, which cargo verify installs: --test commands -- --ignored in_a_browser"]
fn a_phone_scrolls_down_only_and_colours_follow_the_reader_in_a_browser() {
    let mut browser = Browser::start(390);
    let page = write_page(&browser);
    browser.open(&page);
    let widths = "[document.documentElement.scrollWidth, document.querySelector('canvas').getBoundingClientRect().right]";
    for part in browser.value(widths).as_array().expect("two widths") {
        assert!(
            part.as_f64().is_some_and(|width| width <= 390.0),
            "{part} pixels wide"
        );
    }
    let light = drawn(&mut browser, "residual-angle-x");
    let dark = json!({ "features": [{ "name": "prefers-color-scheme", "value": "dark" }] });
    browser.call("Emulation.setEmulatedMedia", dark);
    assert!(
        drawn(&mut browser, "residual-angle-x") != light,
        "the plot keeps the colours of a light page"
    );
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
#[ignore = "needs Chromium, which cargo verify installs: --test commands -- --ignored in_a_browser"]
fn every_printed_page_has_words_in_a_browser() {
    let mut browser = Browser::start(1200);
    let page = write_page(&browser);
    browser.open(&page);
    let printed = browser.call(
        "Page.printToPDF",
        json!({ "printBackground": true, "preferCSSPageSize": true }),
    );
    let printed = STANDARD
        .decode(printed["data"].as_str().expect("a file"))
        .expect("base64");
    let pages = contents(&printed);
    assert!((2..=8).contains(&pages.len()), "{} pages", pages.len());
    for (number, page) in pages.iter().enumerate() {
        let words = page.matches("Tj").count() + page.matches("TJ").count();
        assert!(words > 10, "page {} has {words} words", number + 1);
    }
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

/// Returns the drawing operators of each page of a PDF.
fn contents(pdf: &[u8]) -> Vec<String> {
    let text = String::from_utf8_lossy(pdf).into_owned();
    let objects = text.split("/Type /Page\n").skip(1);
    objects
        .map(|object| {
            let (_, number) = object
                .split_once("/Contents ")
                .expect("a page has contents");
            let number: u32 = number
                .split(' ')
                .next()
                .and_then(|n| n.parse().ok())
                .expect("a number");
            stream(pdf, number)
        })
        .collect()
}

/// Returns the deflated stream of an object of a PDF, as text.
fn stream(pdf: &[u8], number: u32) -> String {
    let head = format!("\n{number} 0 obj");
    let find = |from: usize, what: &[u8]| {
        let place = pdf[from..]
            .windows(what.len())
            .position(|window| window == what);
        from + place.unwrap_or_else(|| panic!("no {what:?}")) + what.len()
    };
    let begin = find(find(0, head.as_bytes()), b"stream\n");
    let mut text = Vec::new();
    std::io::Read::read_to_end(&mut ZlibDecoder::new(&pdf[begin..]), &mut text)
        .expect("a deflated stream");
    String::from_utf8_lossy(&text).into_owned()
}

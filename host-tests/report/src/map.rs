//! Maps of the significant residual: time × band, one map a gyro.
//!
//! Each [`Tile`] is coloured by its p-value times the number of tiles (Bonferroni). Held-out time is marked by a bar along
//! the top.
//!
//! A recording of many tiles is drawn in [`COLUMNS`] columns, each with its smallest p-value.

use maud::{Markup, html};
use plotters::prelude::*;

use super::chart::Numbers;
use super::curves::time_range;
use super::plot::{Axes, FINE, INK, builder, frame, plot};
use super::words::number;
use rlg_diagnosis::tiles::locate::Tile;
use rlg_diagnosis::tiles::pictures::Pictures;
use rlg_recording::AXES;

/// Height of a map \[page pixels\].
const HEIGHT: u32 = 230;

/// Largest number of columns: narrower ones would not be visible, and the page would grow with the recording.
const COLUMNS: usize = 150;

/// Height of the held-out bar, as a share of a row's height.
const BAR: f64 = 0.35;

/// Colours of a tile's p-value: noise, the diagnosis's threshold, and [`FURTHER`]. One hue from light to dark, readable
/// without colour.
const COLOURS: [RGBColor; 5] = [
    RGBColor(0xEE, 0xEE, 0xEE),
    RGBColor(0xF6, 0xC9, 0x8B),
    RGBColor(0xE6, 0x9F, 0x00),
    RGBColor(0xC0, 0x4F, 0x00),
    RGBColor(0x6B, 0x22, 0x00),
];

/// Smaller p-values with a colour of their own.
const FURTHER: [f64; 3] = [1e-8, 1e-16, 1e-32];

/// p-values below which a tile has the colour of the same place.
fn limits(significance: f64) -> [f64; COLOURS.len()] {
    let [third, fourth, fifth] = FURTHER;
    [f64::INFINITY, significance, third, fourth, fifth]
}

/// Rectangle of the map.
struct Cell {
    begin_s: f64,
    end_s: f64,
    band: usize,
    chance: f64,
}

/// Map of one gyro before (`tiles_before`) or after the correction of the found effects.
pub fn map(pictures: &Pictures, axis: usize, after: bool) -> Markup {
    let (tiles, when) = if after {
        (&pictures.tiles_after, "after")
    } else {
        (&pictures.tiles_before, "before")
    };
    let bands = bands(&pictures.tiles_before);
    let label = format!(
        "Chance of the residual of gyro {} being noise, {when}, by time and band",
        AXES[axis]
    );
    plot(&label, HEIGHT, |area| {
        let rows = bands.len().max(1) as f64;
        let x = time_range(pictures);
        // Labels are at the edges between bands.
        let mut chart = builder(area).build_cartesian_2d(x, 0.0..rows + BAR)?;
        let edge = |place: &f64| match (place.fract() == 0.0, bands.get(*place as usize)) {
            (true, Some((low, _))) => number(*low),
            (true, None) => bands
                .last()
                .map_or(String::new(), |(_, high)| number(*high)),
            (false, _) => String::new(),
        };
        let axes = Axes {
            x_title: "time [s]",
            y_title: "band [Hz]",
            x_number: &|time_s| number(*time_s),
            y_number: &edge,
            y_count: bands.len() + 2,
        };
        frame(&mut chart, &axes)?;
        let cells = cells(pictures, tiles, axis, &bands);
        chart.draw_series(cells.iter().map(|cell| {
            let row = cell.band as f64;
            let colour = colour(cell.chance * tiles.len() as f64, pictures.significance);
            Rectangle::new(
                [(cell.begin_s, row), (cell.end_s, row + 1.0)],
                colour.filled(),
            )
        }))?;
        chart.draw_series(pictures.held_out_s.iter().map(|[begin, end]| {
            let (low, high) = (rows + BAR / 3.0, rows + BAR);
            Rectangle::new([(*begin, low), (*end, high)], INK.filled())
        }))?;
        // Lines between the bands, over the tiles.
        chart.draw_series((1..bands.len()).map(|row| {
            let ends = [
                (time_range(pictures).start, row as f64),
                (time_range(pictures).end, row as f64),
            ];
            PathElement::new(ends, WHITE.stroke_width(FINE / 2))
        }))?;
        Ok(())
    })
}

/// Name of the map of a gyro.
pub fn id(axis: usize, after: bool) -> String {
    let when = if after { "after" } else { "before" };
    format!("map-{}-{when}", AXES[axis])
}

/// Data of a map as drawn.
pub fn numbers(pictures: &Pictures, axis: usize, after: bool) -> Numbers {
    let tiles = if after {
        &pictures.tiles_after
    } else {
        &pictures.tiles_before
    };
    let bands = bands(&pictures.tiles_before);
    let cells = cells(pictures, tiles, axis, &bands);
    let column = |of: &dyn Fn(&Cell) -> f64| cells.iter().map(of).collect::<Vec<f64>>();
    Numbers {
        id: id(axis, after),
        columns: &[
            "begin [s]",
            "end [s]",
            "band from [Hz]",
            "band to [Hz]",
            "chance of noise in one tile",
        ],
        data: vec![
            column(&|cell| cell.begin_s),
            column(&|cell| cell.end_s),
            column(&|cell| bands[cell.band].0),
            column(&|cell| bands[cell.band].1),
            column(&|cell| cell.chance),
        ],
    }
}

/// True if any tile of a gyro is significant, before or after.
pub fn stands_out(pictures: &Pictures, axis: usize) -> bool {
    let tiles = [&pictures.tiles_before, &pictures.tiles_after];
    tiles.into_iter().any(|tiles| {
        let own = tiles.iter().filter(|tile| tile.axis == axis);
        own.into_iter()
            .any(|tile| tile.chance * (tiles.len() as f64) < pictures.significance)
    })
}

/// Legend of the colours.
pub fn legend(pictures: &Pictures) -> Markup {
    let words = limits(pictures.significance).map(|limit| match limit.is_finite() {
        true => below(limit),
        false => "noise".to_owned(),
    });
    html! {
        p.legend {
            "Chance of being noise: "
            @for (RGBColor(red, green, blue), words) in COLOURS.iter().zip(&words) {
                span.key {
                    svg.swatch viewBox="0 0 14 14" aria-hidden="true" {
                        rect width="14" height="14" fill=(format!("#{red:02X}{green:02X}{blue:02X}")) {}
                    }
                    (words)
                }
            }
            span.key {
                svg.swatch viewBox="0 0 14 14" aria-hidden="true" { rect y="5" width="14" height="4" fill="#222222" {} }
                "held out"
            }
        }
    }
}

fn colour(chance: f64, significance: f64) -> RGBColor {
    let limits = limits(significance);
    let level = limits.iter().rposition(|limit| chance < *limit);
    COLOURS[level.unwrap_or(0)]
}

/// "< 10⁻⁴" for 1e-4.
fn below(limit: f64) -> String {
    let text = format!("{limit:e}");
    let (factor, power) = text.split_once('e').unwrap_or((&text, "0"));
    let raised = power.chars().map(|digit| match digit.to_digit(10) {
        Some(digit) => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize],
        None => '⁻',
    });
    let raised: String = raised.collect();
    match factor {
        "1" => format!("< 10{raised}"),
        _ => format!("< {factor} × 10{raised}"),
    }
}

/// Bands in rising order.
fn bands(tiles: &[Tile]) -> Vec<(f64, f64)> {
    let mut bands: Vec<(f64, f64)> = tiles.iter().map(|tile| tile.band_hz).collect();
    bands.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    bands.dedup_by(|a, b| a.0 == b.0);
    bands
}

fn cells(pictures: &Pictures, tiles: &[Tile], axis: usize, bands: &[(f64, f64)]) -> Vec<Cell> {
    let time_s = |row: usize| pictures.start_s + row as f64 / pictures.rate_hz;
    let own = tiles.iter().filter(|tile| tile.axis == axis);
    let all = own.filter_map(|tile| {
        Some(Cell {
            begin_s: time_s(tile.rows.start),
            end_s: time_s(tile.rows.end),
            band: bands.iter().position(|band| band.0 == tile.band_hz.0)?,
            chance: tile.chance,
        })
    });
    let all: Vec<Cell> = all.collect();
    if all.len() <= COLUMNS * bands.len() {
        return all;
    }
    let time = time_range(pictures);
    let width_s = (time.end - time.start) / COLUMNS as f64;
    let mut least = vec![None::<f64>; COLUMNS * bands.len()];
    for cell in &all {
        let first = ((cell.begin_s - time.start) / width_s) as usize;
        let last = (((cell.end_s - time.start) / width_s).ceil() as usize).max(first + 1);
        for column in first..last.min(COLUMNS) {
            let slot = &mut least[column * bands.len() + cell.band];
            *slot = Some(slot.map_or(cell.chance, |known| known.min(cell.chance)));
        }
    }
    let thinned = least.iter().enumerate().filter_map(|(slot, chance)| {
        let begin_s = time.start + (slot / bands.len()) as f64 * width_s;
        Some(Cell {
            begin_s,
            end_s: begin_s + width_s,
            band: slot % bands.len(),
            chance: (*chance)?,
        })
    });
    thinned.collect()
}

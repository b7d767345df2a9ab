//! Recordings, models and results on disk: written files are read back, files of others are read, and unusable files are
//! refused in one sentence. One binary, because linking each of these tests takes longer than running it.

mod bad_input;
mod damaged_recordings;
mod export;
mod first_finding;
mod health;
mod import;
mod import_columns;
mod import_dates;
mod import_foreign;
mod import_headers;
mod import_matrices;
mod import_raw;
mod import_strangers;
mod model_compensation;
mod model_new;
mod model_round_trip;
mod output_folder;
mod parquet_file;
mod recording_bench;
mod recording_elsewhere;
mod recording_parquet;
mod recording_range;
mod recording_round_trip;
mod refusals;
mod tutorial;

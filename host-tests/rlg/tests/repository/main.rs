//! The repository itself: dependencies between packages, and correctness of the pages.

mod architecture;
mod files_page;
mod foreign_files;
mod pages;
mod words;

//! The repository itself: which package knows which, and whether the pages are right.

mod architecture;
mod files_page;
mod foreign_files;
mod pages;

//! The program: its commands, pictures and page, and what the documents say that it does.

mod cli;
mod measure;
mod plots;
mod preview;
mod readme;
mod saves;
mod studio;

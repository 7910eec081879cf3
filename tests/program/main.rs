//! The program: its commands, pictures and page, and what the documents say that it does.

mod cli;
mod commands;
mod documents;
mod measure;
mod plots;
mod preview;
mod studio;

//! The `overcoat` program; everything it does is in [`overcoat::cli`].

fn main() -> std::process::ExitCode {
    overcoat::cli::main()
}

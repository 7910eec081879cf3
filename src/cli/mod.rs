//! The command line program: one file per command. Takes arguments and scripts in, writes results to stdout, messages
//! and progress to stderr. Exit status: 0 fine, 1 the script has errors, 2 wrong usage or I/O, 3 a check failed.

mod albedo;
mod audit;
mod check;
mod cost;
mod eval;
mod explain;
mod extremes;
mod furnace;
mod gallery;
mod host;
mod input;
mod lobes;
mod output;
mod plot;
mod reciprocity;
mod reference;
mod render;
mod reproduce;
mod sample;
#[cfg(feature = "studio")]
mod studio;
mod tradeoff;
mod tree;

#[cfg(feature = "studio")]
#[doc(hidden)]
pub use studio::Desk;

use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use std::process::ExitCode;

/// Layered, energy-conserving BSDFs from Open Shading Language style scripts.
#[derive(Parser, Debug)]
#[command(name = "overcoat", version, about, max_term_width = 100)]
struct Cli {
    #[command(flatten)]
    global: Global,
    #[command(subcommand)]
    command: Command,
}

/// Options every command takes.
#[derive(Args, Debug, Clone)]
struct Global {
    /// Set a shader parameter: a number, three numbers `r,g,b`, or a string. Repeatable.
    #[arg(long, global = true, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Accuracy and speed; `standard` if not given.
    #[arg(long, global = true, value_enum)]
    tier: Option<TierArg>,
    /// How a layer scales what lies below it.
    #[arg(long, global = true, value_enum, default_value = "min")]
    layering: LayeringArg,
    /// Which channels of a top's albedo a layer answers to.
    #[arg(long, global = true, value_enum, default_value = "largest")]
    tint_rule: TintArg,
    /// Look here for what scripts `#include` and for textures. Repeatable; the script's own directory comes first.
    #[arg(short = 'I', long = "include", global = true, value_name = "DIR")]
    include: Vec<PathBuf>,
    /// Write one JSON document to stdout.
    #[arg(long, global = true)]
    json: bool,
    /// No progress, no warnings.
    #[arg(long, short, global = true)]
    quiet: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum TierArg {
    Fast,
    Standard,
    Reference,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum LayeringArg {
    /// min(α(ωo), α(ωi)): reciprocal, never gains.
    Min,
    /// s(ωo)·s(ωi), solved per lobe: reciprocal, lossless below reciprocal tops.
    Balanced,
    /// 1 − E(ωo): loses nothing toward the camera, not reciprocal.
    View,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum TintArg {
    /// The largest channel dims all.
    Largest,
    /// Each channel dims itself.
    Channel,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Print the closure tree a script leaves, after its parameters are set.
    Tree {
        /// The script; `-` reads stdin.
        file: PathBuf,
        /// Also tell how each lobe below a layer is scaled, and what specialising removed, and why.
        #[arg(long)]
        explain: bool,
    },
    /// Evaluate f·|cos θi| and the pdf for a pair of directions.
    Eval {
        /// The script; `-` reads stdin.
        file: PathBuf,
        /// Toward the viewer, world space; normalised.
        #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
        wo: String,
        /// Toward the light, world space; normalised. Repeatable.
        #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, required = true)]
        wi: Vec<String>,
    },
    /// Draw directions for one ωo, as CSV.
    Sample {
        /// The script; `-` reads stdin.
        file: PathBuf,
        /// Toward the viewer, world space; normalised.
        #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
        wo: String,
        /// How many.
        #[arg(long, default_value_t = 16)]
        count: u64,
        /// Same seed, same samples.
        #[arg(long, default_value_t = 0)]
        seed: u64,
    },
    /// Measure the directional albedo by quadrature, delta lobes included.
    Albedo(albedo::AlbedoArgs),
    /// Measure random trees of all lobes: does any gain energy?
    Audit(audit::AuditArgs),
    /// Prove that scripts keep energy for all parameters in their ranges and all directions, or show where one gains.
    Check(check::CheckArgs),
    /// What the material makes a renderer pay: lobes, globals, bytes, nanoseconds.
    Cost {
        /// The script; `-` reads stdin.
        file: PathBuf,
    },
    /// Say more about the code of a message, such as E0203; without one, list all.
    Explain {
        /// The code.
        code: Option<String>,
    },
    /// Every lobe at the ends of its parameters and angles: is any result infinite, undefined or negative, and how large
    /// do rounding errors get?
    Extremes(extremes::ExtremesArgs),
    /// Put the material in a white furnace: the albedo over a grid of directions, from both sides.
    Furnace(furnace::FurnaceArgs),
    /// Draw how the material scatters, where its energy goes, and how noisily it is sampled, as an SVG.
    Plot(plot::PlotArgs),
    /// Show every script of a folder on every scene, as one page.
    Gallery(gallery::GalleryArgs),
    /// Does the material scatter alike when light and viewer change places?
    Reciprocity(reciprocity::ReciprocityArgs),
    /// List the closures a script can call.
    Lobes {
        /// Only those of this name.
        name: Option<String>,
        /// Write the header that declares to other compilers what their own header lacks.
        #[arg(long, conflicts_with = "name")]
        header: bool,
        /// Write the reference of all closures, as docs/lobes.md holds it.
        #[arg(long, conflicts_with_all = ["name", "header"])]
        markdown: bool,
        /// Render a picture beside each script of a folder, as docs/lobes holds them.
        #[arg(long, value_name = "DIR", conflicts_with_all = ["name", "header", "markdown"])]
        gallery: Option<PathBuf>,
    },
    /// What speed costs in accuracy: tiers, layering rules and table sizes, timed and compared with the reference.
    Tradeoff(tradeoff::TradeoffArgs),
    /// Make a picture of the material.
    Render(render::RenderArgs),
    /// Make the figures of the papers the lobes come from, with what they say and what was measured.
    Reproduce(reproduce::ReproduceArgs),
    /// Edit a material in the browser: its picture, its parameters, where its energy goes.
    #[cfg(feature = "studio")]
    Studio(studio::StudioArgs),
}

/// Why a command stops.
enum Failure {
    /// The script has errors: the rendered messages.
    Script(String),
    /// Wrong usage, or a file that cannot be read or written.
    Usage(String),
    /// What was checked does not hold.
    Check(String),
    /// All has been said; the exit status is left.
    Status(u8),
    /// Whoever reads stdout has gone.
    Closed,
}

impl Failure {
    fn usage(message: impl Into<String>) -> Failure {
        Failure::Usage(message.into())
    }
}

type Outcome = Result<(), Failure>;

/// Runs the program with the arguments of the process.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let outcome = match &cli.command {
        Command::Tree { file, explain } => tree::run(&cli.global, file, *explain),
        Command::Eval { file, wo, wi } => eval::run(&cli.global, file, wo, wi),
        Command::Sample { file, wo, count, seed } => sample::run(&cli.global, file, wo, *count, *seed),
        Command::Albedo(args) => albedo::run(&cli.global, args),
        Command::Audit(args) => audit::run(&cli.global, args),
        Command::Check(args) => check::run(&cli.global, args),
        Command::Cost { file } => cost::run(&cli.global, file),
        Command::Explain { code } => explain::run(&cli.global, code.as_deref()),
        Command::Extremes(args) => extremes::run(&cli.global, args),
        Command::Furnace(args) => furnace::run(&cli.global, args),
        Command::Gallery(args) => gallery::run(&cli.global, args),
        Command::Plot(args) => plot::run(&cli.global, args),
        Command::Reciprocity(args) => reciprocity::run(&cli.global, args),
        Command::Lobes { header: true, .. } => lobes::header(),
        Command::Lobes { markdown: true, .. } => reference::markdown(),
        Command::Lobes { gallery: Some(folder), .. } => reference::gallery(&cli.global, folder),
        Command::Lobes { name, .. } => lobes::run(&cli.global, name.as_deref()),
        Command::Tradeoff(args) => tradeoff::run(&cli.global, args),
        Command::Render(args) => render::run(&cli.global, args),
        Command::Reproduce(args) => reproduce::run(&cli.global, args),
        #[cfg(feature = "studio")]
        Command::Studio(args) => studio::run(&cli.global, args),
    };
    match outcome {
        Ok(()) | Err(Failure::Closed) => ExitCode::SUCCESS,
        Err(Failure::Status(status)) => ExitCode::from(status),
        Err(Failure::Script(messages)) => {
            eprintln!("{}", messages.trim_end());
            ExitCode::from(1)
        }
        Err(Failure::Usage(message)) => {
            eprintln!("error: {message}");
            ExitCode::from(2)
        }
        Err(Failure::Check(message)) => {
            eprintln!("{message}");
            ExitCode::from(3)
        }
    }
}

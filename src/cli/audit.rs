//! `overcoat audit`: a campaign of random trees, in one piece or in shards.

use super::output::{self, word as name};
use super::{Failure, Global, Outcome};
use crate::audit::campaign::{Campaign, Case, Found, LEVELS, Method, Tally, Verdict};
use crate::audit::{Albedo, Side};
use crate::closure::{Layering, LayeringRule, TintRule};
use crate::engine::Tier;
use crate::preview::output::{check_writable, replace};
use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fmt::{Debug, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(Args, Debug)]
pub struct AuditArgs {
    /// How many trees.
    #[arg(long, default_value_t = 10_000)]
    trees: u64,
    /// Same seed, same trees, whatever the number of threads or shards.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Measure one of N parts of the campaign, numbered from 1.
    #[arg(long, value_name = "I/N")]
    shard: Option<String>,
    /// Worker threads; 0: one per core.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Also write the result to a file, as JSON.
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Add up the results of shards in place of measuring.
    #[arg(long, num_args = 1.., value_name = "FILE", conflicts_with_all = ["trees", "seed", "shard", "threads"])]
    merge: Vec<PathBuf>,
}

/// What was measured of which campaign.
struct Report {
    campaign: Campaign,
    /// From 1 on.
    shards: BTreeSet<u64>,
    of: u64,
    tally: Tally,
    /// Added up over the shards.
    seconds: f64,
}

pub fn run(global: &Global, args: &AuditArgs) -> Outcome {
    if let Some(path) = &args.output {
        check_writable(path).map_err(|e| Failure::usage(e.to_string()))?;
    }
    let report = if args.merge.is_empty() { measure(global, args)? } else { merge(&args.merge)? };
    let document = report.json();
    if let Some(path) = &args.output {
        replace(path, format!("{document:#}\n").as_bytes()).map_err(|e| Failure::usage(e.to_string()))?;
    }
    if global.json {
        output::json(&document)?;
    } else {
        output::write(&report.text())?;
    }
    match (report.tally.violations, report.tally.unresolved) {
        (0, 0) => Ok(()),
        (0, n) => Err(Failure::Check(format!("{n} trees could not be measured well enough to tell"))),
        (n, _) => Err(Failure::Check(format!("{n} trees gain energy"))),
    }
}

fn measure(global: &Global, args: &AuditArgs) -> Result<Report, Failure> {
    let tiers = global.tier().map_or(vec![Tier::Fast, Tier::Standard], |tier| vec![tier]);
    let campaign = Campaign { trees: args.trees, seed: args.seed, tiers };
    let (shard, of) = args.shard.as_deref().map_or(Ok((1, 1)), shard)?;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(args.threads)
        .build()
        .map_err(|e| Failure::usage(format!("--threads {}: {e}", args.threads)))?;
    let blocks: Vec<u64> = (0..campaign.blocks()).filter(|b| b % of == shard - 1).collect();
    let bar = progress_bar(global, blocks.iter().map(|b| campaign.trees_of(*b).count() as u64).sum());
    let start = Instant::now();
    let mut tally = Tally::default();
    for index in blocks {
        let block = campaign.block(index);
        let measured = pool.install(|| {
            let one = |mut tally: Tally, tree: u64| {
                tally.add(block.measure(tree), || block.script(tree));
                bar.inc(1);
                tally
            };
            let both = |mut a: Tally, b: Tally| {
                a.merge(b);
                a
            };
            campaign.trees_of(index).into_par_iter().fold(Tally::default, one).reduce(Tally::default, both)
        });
        tally.merge(measured);
    }
    bar.finish_and_clear();
    Ok(Report { campaign, shards: BTreeSet::from([shard]), of, tally, seconds: start.elapsed().as_secs_f64() })
}

/// Reads `I/N`.
fn shard(text: &str) -> Result<(u64, u64), Failure> {
    let parsed = text.split_once('/').and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
    match parsed {
        Some((i, n)) if i >= 1 && i <= n => Ok((i, n)),
        _ => Err(Failure::usage(format!("--shard {text}: expected I/N with I from 1 to N, as in 2/8"))),
    }
}

fn progress_bar(global: &Global, trees: u64) -> ProgressBar {
    let target = if global.quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let bar = ProgressBar::with_draw_target(Some(trees), target);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos} of {len} trees  {eta} left") {
        bar.set_style(style);
    }
    bar
}

fn merge(files: &[PathBuf]) -> Result<Report, Failure> {
    let mut whole: Option<(Report, &Path)> = None;
    for path in files {
        let part = Report::read(path)?;
        let Some((whole, first)) = &mut whole else {
            whole = Some((part, path));
            continue;
        };
        let (name, first) = (path.display(), first.display());
        if part.campaign != whole.campaign || part.of != whole.of {
            return Err(Failure::usage(format!("`{name}` and `{first}` are not parts of the same campaign")));
        }
        if let Some(twice) = part.shards.intersection(&whole.shards).next() {
            return Err(Failure::usage(format!("`{name}`: shard {twice} is there already")));
        }
        whole.shards.extend(&part.shards);
        whole.tally.merge(part.tally);
        whole.seconds += part.seconds;
    }
    let Some((whole, _)) = whole else { return Err(Failure::usage("--merge: no file")) };
    if let Some(missing) = (1..=whole.of).find(|i| !whole.shards.contains(i)) {
        let message = format!("shard {missing} of {} is missing", whole.of);
        return Err(Failure::usage(message));
    }
    Ok(whole)
}

/// The one of `all` with this name.
fn named<T: Debug + Copy>(all: &[T], text: &Value) -> Option<T> {
    all.iter().copied().find(|x| text == name(x).as_str())
}

const TIERS: [Tier; 3] = [Tier::Fast, Tier::Standard, Tier::Reference];
const SIDES: [Side; 2] = [Side::View, Side::Light];
const TINTS: [TintRule; 2] = [TintRule::Largest, TintRule::Channel];
const METHODS: [Method; 4] = [Method::Sampled, Method::Resampled, Method::Integrated, Method::InDouble];
const VERDICTS: [Verdict; 3] = [Verdict::Holds, Verdict::Unresolved, Verdict::Gains];

impl Report {
    fn json(&self) -> Value {
        let t = &self.tally;
        let above: Vec<Value> = LEVELS.iter().zip(t.above).map(|(l, n)| json!({"albedo": l, "trees": n})).collect();
        json!({
            "trees": self.campaign.trees,
            "seed": self.campaign.seed,
            "tiers": self.campaign.tiers.iter().map(name).collect::<Vec<_>>(),
            "shards": self.shards,
            "of": self.of,
            "measured": t.trees,
            "lobes": t.lobes,
            "resampled": t.resampled,
            "integrated": t.integrated,
            "in_double": t.in_double,
            "unresolved": t.unresolved,
            "violations": t.violations,
            "above": above,
            "seconds": (self.seconds * 10.0).round() / 10.0,
            "worst": t.worst.iter().map(found_json).collect::<Vec<_>>(),
        })
    }

    fn read(path: &Path) -> Result<Report, Failure> {
        let file = path.display();
        let text = std::fs::read(path).map_err(|e| Failure::usage(format!("cannot read `{file}`: {e}")))?;
        let document: Value =
            serde_json::from_slice(&text).map_err(|e| Failure::usage(format!("`{file}` is not JSON: {e}")))?;
        Report::of(&document).ok_or_else(|| Failure::usage(format!("`{file}` is no result of `overcoat audit`")))
    }

    fn of(v: &Value) -> Option<Report> {
        let count = |key: &str| v[key].as_u64();
        let tiers = v["tiers"].as_array()?.iter().map(|t| named(&TIERS, t)).collect::<Option<Vec<_>>>()?;
        let mut tally = Tally {
            trees: count("measured")?,
            lobes: count("lobes")?,
            resampled: count("resampled")?,
            integrated: count("integrated")?,
            in_double: count("in_double")?,
            unresolved: count("unresolved")?,
            violations: count("violations")?,
            ..Tally::default()
        };
        for (count, level) in tally.above.iter_mut().zip(v["above"].as_array()?) {
            *count = level["trees"].as_u64()?;
        }
        tally.worst = v["worst"].as_array()?.iter().map(found).collect::<Option<Vec<_>>>()?;
        Some(Report {
            campaign: Campaign { trees: count("trees")?, seed: count("seed")?, tiers },
            shards: v["shards"].as_array()?.iter().map(Value::as_u64).collect::<Option<_>>()?,
            of: count("of")?,
            tally,
            seconds: v["seconds"].as_f64()?,
        })
    }

    fn text(&self) -> String {
        let t = &self.tally;
        let mut text = String::new();
        let tiers: Vec<String> = self.campaign.tiers.iter().map(name).collect();
        let _ = writeln!(
            text,
            "{} trees of {} lobes on average, {}, {:.0} s",
            t.trees,
            round(t.lobes as f64 / t.trees.max(1) as f64),
            tiers.join(" and "),
            self.seconds
        );
        for (level, count) in LEVELS.iter().zip(t.above) {
            let _ = writeln!(text, "  {count} with an albedo above {level}");
        }
        let (again, integrated, in_double) = (t.resampled, t.integrated, t.in_double);
        let _ =
            writeln!(text, "  {again} sampled again, {integrated} integrated, {in_double} of them in double precision");
        let _ = writeln!(text, "  {} unresolved, {} gain", t.unresolved, t.violations);
        if !t.worst.is_empty() {
            text.push_str("\nthe worst, with what to measure them by:\n");
        }
        for Found { case, script } in &t.worst {
            let [r, g, b] = case.albedo.value;
            let file = format!("tree-{}.osl", case.tree);
            let _ = writeln!(
                text,
                "\n// tree {}: albedo {r:.6} {g:.6} {b:.6}, error {:.1e}, {}\n// overcoat {}\n{}",
                case.tree,
                case.albedo.error,
                name(case.method),
                case.command(&file),
                script.trim_end()
            );
        }
        text
    }
}

fn round(x: f64) -> f64 {
    (x * 10.0).round() / 10.0
}

fn found_json(Found { case, script }: &Found) -> Value {
    json!({
        "tree": case.tree,
        "tier": name(case.tier),
        "layering": name(case.layering.rule),
        "tint_rule": name(case.layering.tint),
        "side": name(case.side),
        "cos": case.cos,
        "phi": case.phi,
        "lobes": case.lobes,
        "albedo": case.albedo.value,
        "error": case.albedo.error,
        "method": name(case.method),
        "verdict": name(case.verdict),
        "command": format!("overcoat {}", case.command(&format!("tree-{}.osl", case.tree))),
        "script": script,
    })
}

fn found(v: &Value) -> Option<Found> {
    let mut value = [0.0; 3];
    for (value, number) in value.iter_mut().zip(v["albedo"].as_array()?) {
        *value = number.as_f64()?;
    }
    let case = Case {
        tree: v["tree"].as_u64()?,
        tier: named(&TIERS, &v["tier"])?,
        layering: Layering { rule: named(&LayeringRule::ALL, &v["layering"])?, tint: named(&TINTS, &v["tint_rule"])? },
        side: named(&SIDES, &v["side"])?,
        cos: v["cos"].as_f64()?,
        phi: v["phi"].as_f64()?,
        lobes: u32::try_from(v["lobes"].as_u64()?).ok()?,
        albedo: Albedo { value, error: v["error"].as_f64()? },
        method: named(&METHODS, &v["method"])?,
        verdict: named(&VERDICTS, &v["verdict"])?,
    };
    Some(Found { case, script: v["script"].as_str()?.to_owned() })
}

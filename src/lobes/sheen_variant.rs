//! The models that a sheen may follow. Not a lobe itself.

use super::charlie;
use super::ltc;
use super::ltc_tables::{SHEEN, SOFTENED, ZELTNER};

/// One model with its switches thrown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Variant {
    Softened,
    Fitted,
    RefitSoftened,
    Refit,
    Exact,
    CharlieV,
    Zeltner,
}

use Variant::{CharlieV, Exact, Fitted, Refit, RefitSoftened, Softened, Zeltner};

impl Variant {
    pub const ALL: [Variant; 7] = [Softened, Fitted, RefitSoftened, Refit, Exact, CharlieV, Zeltner];

    /// From the slot values of `mode`, `model` and `softening`.
    pub fn of(mode: u32, model: u32, softening: u32) -> Variant {
        let model = if model == 0 { [1, 5][mode.min(1) as usize] } else { model };
        match (model, softening) {
            (1, 0) => Fitted,
            (1, _) => Softened,
            (2, 0) => Refit,
            (2, _) => RefitSoftened,
            (3, _) => Exact,
            (4, _) => CharlieV,
            _ => Zeltner,
        }
    }

    /// The smallest roughness; lower ones are taken as this.
    pub fn floor(self) -> f64 {
        match self {
            Softened | Fitted => 0.07,
            RefitSoftened | Refit | CharlieV => 0.02,
            Exact => charlie::MIN_ROUGHNESS,
            Zeltner => 0.05,
        }
    }

    /// What it is sampled by; under `zeltner` also what it is.
    pub fn table(self) -> &'static ltc::Table {
        match self {
            Softened | RefitSoftened => &SOFTENED,
            Fitted | Refit | Exact | CharlieV => &SHEEN,
            Zeltner => &ZELTNER,
        }
    }

    /// The one whose bit is set, if it is the only one.
    pub fn only(mask: u32) -> Option<Variant> {
        if mask.is_power_of_two() { Variant::ALL.get(mask.trailing_zeros() as usize).copied() } else { None }
    }

    pub fn reciprocal(self) -> bool {
        matches!(self, Fitted | Refit | Exact | CharlieV)
    }

    /// Whether E exceeds 1 for some angle at some roughness from `roughness` up.
    pub fn gains(self, roughness: f64) -> bool {
        match self {
            Softened | Fitted | RefitSoftened | Refit | Exact => false,
            CharlieV => roughness < 0.205,
            Zeltner => true,
        }
    }
}

//! "Did you mean …?"

/// The candidate most like `name`, if one is like it at all.
pub fn suggest<'c>(name: &str, candidates: impl IntoIterator<Item = &'c str>) -> Option<&'c str> {
    if name.len() > 64 {
        return None;
    }
    let lower = name.to_lowercase();
    let mut best: Option<(f64, &str)> = None;
    for candidate in candidates {
        let other = candidate.to_lowercase();
        let spelling = strsim::normalized_damerau_levenshtein(&lower, &other);
        // A word left off at either end is the other common slip: `sheen` for `sheen_bsdf`.
        let part = lower.len() >= 3 && (other.starts_with(&lower) || lower.starts_with(&other) && other.len() >= 3);
        let score = if part { spelling.max(0.65) } else { spelling };
        if score >= 0.6 && candidate != name && best.is_none_or(|(s, _)| score > s) {
            best = Some((score, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::suggest;

    #[test]
    fn near_names_are_found_and_far_ones_are_not() {
        let names = ["roughness", "tint", "diffuse", "sheen_bsdf"];
        assert_eq!(suggest("roughnes", names), Some("roughness"));
        assert_eq!(suggest("Diffuse", names), Some("diffuse"));
        assert_eq!(suggest("sheen", names), Some("sheen_bsdf"));
        assert_eq!(suggest("glass", names), None);
    }
}

//! What lies between the nodes of a cloth's table, judged by its second differences.

use super::fibre::COMPONENTS;

/// What linear interpolation about a node of a cloth's table misses, per component.
#[derive(Clone, Copy)]
pub(super) struct Bend {
    /// By how much it may lie below the truth in the cells around.
    pub low: [f64; COMPONENTS],
    /// What the node must rise, or sink, for the errors at the nodes and between them to be equal.
    pub middle: [f64; COMPONENTS],
}

/// Second differences of a cloth's albedos tell what lies between the nodes: probing there would cost three times the
/// nodes themselves, which buys twice the nodes along each side instead.
///
/// With D = 2f(k) − f(k−1) − f(k+1), a smooth f rises D/8 above the line between two nodes, and one with a kink, as at
/// a tangent's horizon, at most half the larger D at the two: six tenths here, because what bends may also be rounded off.
pub(super) fn bends(albedos: &[[f64; COMPONENTS]], rows: usize, nodes: usize) -> Vec<Bend> {
    let difference = |k: usize, c: usize| {
        let (row, node) = (k / nodes % rows, k % nodes);
        let along = |inside: bool, step: usize| {
            if inside { 2.0 * albedos[k][c] - albedos[k - step][c] - albedos[k + step][c] } else { 0.0 }
        };
        [along(node > 0 && node + 1 < nodes, 1), along(row > 0 && row + 1 < rows, nodes)]
    };
    let all: Vec<[[f64; 2]; COMPONENTS]> =
        (0..albedos.len()).map(|k| std::array::from_fn(|c| difference(k, c))).collect();
    let bend = |k: usize| {
        let (sheet, row, node) = (k / (rows * nodes), k / nodes % rows, k % nodes);
        let mut low = [0.0f64; COMPONENTS];
        for r in row.saturating_sub(1)..=(row + 1).min(rows - 1) {
            for n in node.saturating_sub(1)..=(node + 1).min(nodes - 1) {
                let there = all[(sheet * rows + r) * nodes + n];
                low = std::array::from_fn(|c| low[c].max(0.6 * (there[c][0].max(0.0) + there[c][1].max(0.0))));
            }
        }
        Bend { low, middle: all[k].map(|d| (d[0] + d[1]) / 16.0) }
    };
    (0..albedos.len()).map(bend).collect()
}

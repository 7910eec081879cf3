//! Curves and points as SVG pictures.
//!
//! In: named series of points. Out: the text of an SVG file. Drawn by plotters with its SVG backend only; the text is
//! left to the viewer's fonts.

use plotters::prelude::*;
use std::ops::Range;

/// What a plot shows and how.
pub struct Plot<'a> {
    /// Stands above the picture.
    pub title: &'a str,
    /// What runs along the horizontal axis, with its unit.
    pub x: &'a str,
    /// What runs along the vertical axis, with its unit.
    pub y: &'a str,
    /// Name and points of every curve.
    pub series: &'a [(String, Vec<(f64, f64)>)],
}

/// Colours that are told apart in print and by most eyes (Okabe & Ito 2008).
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(60, 60, 60),
];

impl Plot<'_> {
    /// The picture, 720 × 440.
    ///
    /// # Errors
    /// If there is nothing finite to show.
    pub fn svg(&self) -> Result<String, String> {
        let points = || self.series.iter().flat_map(|s| &s.1).filter(|p| p.0.is_finite() && p.1.is_finite());
        let low = |f: fn(&(f64, f64)) -> f64| points().map(f).fold(f64::INFINITY, f64::min);
        let high = |f: fn(&(f64, f64)) -> f64| points().map(f).fold(f64::NEG_INFINITY, f64::max);
        let (x0, x1, y0, y1) = (low(|p| p.0), high(|p| p.0), low(|p| p.1).min(0.0), high(|p| p.1));
        if points().next().is_none() {
            return Err(format!("{}: nothing to plot", self.title));
        }
        let mut text = String::new();
        self.draw(&mut text, [x0, x1.max(x0 + 1e-9), y0, y1.max(y0 + 1e-9) * 1.04]).map_err(|e| e.to_string())?;
        Ok(text)
    }

    /// The picture with one scale for both axes, the middle of the horizontal one at 0: for what is drawn around a
    /// point.
    ///
    /// # Errors
    /// If there is nothing finite to show.
    pub fn svg_to_scale(&self) -> Result<String, String> {
        // Of the area that the axes leave.
        const ASPECT: f64 = 640.0 / 350.0;
        let points = || self.series.iter().flat_map(|s| &s.1).filter(|p| p.0.is_finite() && p.1.is_finite());
        let (x, up) = points().fold((1e-9f64, 1e-9f64), |(x, up), p| (x.max(p.0.abs()), up.max(p.1)));
        let down = points().fold(0.0f64, |down, p| down.min(p.1));
        if points().next().is_none() {
            return Err(format!("{}: nothing to plot", self.title));
        }
        let height = ((up - down) * 1.04).max(2.0 * x * 1.02 / ASPECT);
        let mut text = String::new();
        let half = 0.5 * height * ASPECT;
        self.draw(&mut text, [-half, half, down, down + height]).map_err(|e| e.to_string())?;
        Ok(text)
    }

    fn draw(&self, text: &mut String, [x0, x1, y0, y1]: [f64; 4]) -> Result<(), Box<dyn std::error::Error>> {
        let area = SVGBackend::with_string(text, (720, 440)).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .caption(self.title, ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(56)
            .build_cartesian_2d(x0..x1, y0..y1)?;
        chart.configure_mesh().light_line_style(WHITE).x_desc(self.x).y_desc(self.y).draw()?;
        for (index, (name, points)) in self.series.iter().enumerate() {
            let color = COLORS[index % COLORS.len()];
            let finite = points.iter().copied().filter(|p| p.0.is_finite() && p.1.is_finite());
            chart
                .draw_series(LineSeries::new(finite, color.stroke_width(2)))?
                .label(name.as_str())
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
        }
        if self.series.len() > 1 {
            chart
                .configure_series_labels()
                .position(self.quietest([x0, x1, y0, y1]))
                .background_style(WHITE.mix(0.85))
                .border_style(BLACK.mix(0.3))
                .draw()?;
        }
        area.present()?;
        Ok(())
    }

    /// Where the legend hides least of the curves.
    fn quietest(&self, [x0, x1, y0, y1]: [f64; 4]) -> SeriesLabelPosition {
        use SeriesLabelPosition::{LowerLeft, LowerRight, MiddleRight, UpperLeft, UpperRight};
        // Its size as a part of the picture's.
        let (width, height) = (0.36, 0.04 + 0.055 * self.series.len() as f64);
        let hidden = |left: f64, bottom: f64| {
            let inside = |x: f64, y: f64| (left..left + width).contains(&x) && (bottom..bottom + height).contains(&y);
            let mut count = 0;
            for pair in self.series.iter().flat_map(|s| s.1.windows(2)) {
                count += (0..=32)
                    .filter(|k| {
                        let t = f64::from(*k) / 32.0;
                        let between = |a: f64, b: f64| a + (b - a) * t;
                        let (x, y) = (between(pair[0].0, pair[1].0), between(pair[0].1, pair[1].1));
                        inside((x - x0) / (x1 - x0), (y - y0) / (y1 - y0))
                    })
                    .count();
            }
            count
        };
        let (right, top) = (1.0 - width, 1.0 - height);
        let places = [
            (MiddleRight, hidden(right, 0.5 * top)),
            (UpperRight, hidden(right, top)),
            (LowerRight, hidden(right, 0.0)),
            (UpperLeft, hidden(0.0, top)),
            (LowerLeft, hidden(0.0, 0.0)),
        ];
        places.into_iter().min_by_key(|p| p.1).map_or(MiddleRight, |p| p.0)
    }
}

/// Points on two logarithmic axes.
pub struct Scatter<'a> {
    /// Stands above the picture.
    pub title: &'a str,
    /// What runs along the horizontal axis, with its unit.
    pub x: &'a str,
    /// What runs along the vertical axis, with its unit.
    pub y: &'a str,
    /// Name and points of every group.
    pub groups: &'a [(String, Vec<(f64, f64)>)],
    /// Drawn in gray behind the points.
    pub lines: &'a [Vec<(f64, f64)>],
}

impl Scatter<'_> {
    /// The picture, 900 × 560.
    ///
    /// # Errors
    /// If there is no point that a logarithm exists of.
    pub fn svg(&self) -> Result<String, String> {
        let points = || self.groups.iter().flat_map(|g| &g.1).filter(|p| shown(p));
        if points().next().is_none() {
            return Err(format!("{}: nothing to plot", self.title));
        }
        let range = |f: fn(&(f64, f64)) -> f64| {
            let (lo, hi) = points().map(f).fold((f64::INFINITY, 0.0f64), |(lo, hi), x| (lo.min(x), hi.max(x)));
            lo / 1.5..hi * 1.5
        };
        let mut text = String::new();
        self.draw(&mut text, range(|p| p.0), range(|p| p.1)).map_err(|e| e.to_string())?;
        Ok(text)
    }

    fn draw(&self, text: &mut String, x: Range<f64>, y: Range<f64>) -> Result<(), Box<dyn std::error::Error>> {
        let area = SVGBackend::with_string(text, (900, 560)).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .caption(self.title, ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(72)
            .build_cartesian_2d(x.log_scale(), y.log_scale())?;
        let power = |y: &f64| format!("{y:.0e}");
        let mut mesh = chart.configure_mesh();
        mesh.light_line_style(WHITE).x_desc(self.x).y_desc(self.y).y_label_formatter(&power).draw()?;
        for line in self.lines {
            chart.draw_series(LineSeries::new(line.iter().copied().filter(shown), BLACK.mix(0.25)))?;
        }
        for (index, (name, points)) in self.groups.iter().enumerate() {
            let color = COLORS[index % COLORS.len()];
            let shown = points.iter().copied().filter(shown);
            chart
                .draw_series(shown.map(|p| Circle::new(p, 3, color.filled())))?
                .label(name.as_str())
                .legend(move |(x, y)| Circle::new((x + 9, y), 3, color.filled()));
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .draw()?;
        area.present()?;
        Ok(())
    }
}

/// Whether a point has a place on logarithmic axes.
fn shown(p: &(f64, f64)) -> bool {
    [p.0, p.1].iter().all(|x| x.is_finite() && *x > 0.0)
}

#[cfg(test)]
mod tests {
    use super::{Plot, Scatter};

    #[test]
    fn points_become_a_picture() {
        let groups = [("a".to_owned(), vec![(1.0, 1e-3), (10.0, f64::NAN), (30.0, 1e-6), (2.0, 0.0)])];
        let plot = Scatter { title: "T", x: "x", y: "y", groups: &groups, lines: &[vec![(1.0, 1e-3), (30.0, 1e-6)]] };
        let svg = plot.svg().expect("a picture");
        assert!(svg.matches("<circle").count() == 3 && svg.contains("polyline") && !svg.contains("NaN"));
        assert!(Scatter { groups: &[], ..plot }.svg().is_err());
    }

    #[test]
    fn curves_become_a_picture() {
        let series = [("a".to_owned(), vec![(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0)])];
        let svg = Plot { title: "T", x: "x", y: "y", series: &series }.svg().expect("a picture");
        assert!(svg.starts_with("<svg") && svg.contains("polyline") && !svg.contains("NaN"));
        assert!(Plot { title: "T", x: "x", y: "y", series: &[] }.svg().is_err());
    }
}

//! Colours, dashes and markers of the methods: the same method looks the same in every figure and on every page.
//!
//! A family of methods has one colour; its members differ by dash and marker, and so do the lines of one method.

use crate::report::{Colour, Dash, Marker, Style, palette};
use limitlab::analysis::comparison::MethodRow;
use limitlab::analysis::custom_methods::Named;
use limitlab::solvers::{Accelerated, Method};

const BROWN: Colour = Colour(140, 86, 75);
const GREY: Colour = Colour(120, 120, 120);
const OWN: Colour = Colour(150, 0, 60);

/// How a method is drawn; `variant` is that of its line in a comparison, empty for the first.
pub fn of(method: Method, variant: &str) -> Style {
    let [blue, vermilion, green, purple, orange, sky] = std::array::from_fn(palette);
    let style = |colour, dash, marker| Style { colour, dash, marker };
    match method {
        Method::Jacobi { .. } => style(blue, Dash::Solid, Marker::Circle),
        Method::Thall => style(blue, Dash::Dashed, Marker::InvertedTriangle),
        Method::GaussSeidel { .. } => style(vermilion, Dash::Solid, Marker::Square),
        Method::Sor { .. } => style(vermilion, Dash::Dashed, Marker::Diamond),
        Method::Ssor { .. } => style(vermilion, Dash::Dotted, Marker::Triangle),
        Method::Pia => style(orange, Dash::Solid, Marker::Plus),
        Method::WPia { .. } => style(orange, Dash::Dashed, Marker::Cross),
        Method::Chebyshev { .. } if variant == "proven" => style(green, Dash::Dashed, Marker::Square),
        Method::Chebyshev { .. } => style(green, Dash::Solid, Marker::Diamond),
        Method::HeavyBall { .. } => style(green, Dash::Dotted, Marker::Circle),
        Method::Cg => style(purple, Dash::Solid, Marker::Triangle),
        Method::PlainCg => style(purple, Dash::Dashed, Marker::InvertedTriangle),
        Method::PcgJacobi => style(BROWN, Dash::Solid, Marker::Circle),
        Method::PcgSsor { .. } => style(BROWN, Dash::Dashed, Marker::Square),
        Method::PcgIc0 => style(BROWN, Dash::Dotted, Marker::Cross),
        Method::Anderson { of: Accelerated::Pia { .. }, .. } => style(sky, Dash::Solid, Marker::Plus),
        Method::Anderson { of: Accelerated::Jacobi { .. }, .. } if variant == "of thall" => {
            style(sky, Dash::Dashed, Marker::InvertedTriangle)
        }
        Method::Anderson { of: Accelerated::Jacobi { .. }, .. } => style(sky, Dash::Dotted, Marker::Circle),
        Method::Lu => style(GREY, Dash::Dotted, Marker::InvertedTriangle),
        Method::Cholesky => style(GREY, Dash::Solid, Marker::Triangle),
        Method::SecondCholesky => style(GREY, Dash::Dashed, Marker::Square),
        Method::Ldlt => style(GREY, Dash::DashDotted, Marker::Diamond),
    }
}

/// How the chain that chooses by itself is drawn.
pub fn of_auto() -> Style {
    Style { colour: Colour(0, 0, 0), dash: Dash::Solid, marker: Marker::Circle }
}

/// How a row of a comparison is drawn.
pub fn of_row(row: &MethodRow) -> Style {
    match row.method {
        Named::Ours(method) => of(method, row.variant),
        Named::Own(_) => Style { colour: OWN, dash: Dash::Solid, marker: Marker::Diamond },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use limitlab::analysis::comparison::entries;
    use limitlab::analysis::spectrum::spectrum;
    use limitlab::assemble::LimitSystem;
    use limitlab::mesh::{Surface, builtin};
    use limitlab::schemes::Scheme;

    #[test]
    fn no_two_lines_of_a_comparison_look_the_same() {
        let surface = Surface::new(builtin::builtin("irregular-tri:100").unwrap()).unwrap();
        // Under Loop an interval of Chebyshev's is proven, so that there are all lines.
        let system = LimitSystem::new(&surface, Scheme::Loop).unwrap();
        let lines = entries(&system, &spectrum(&system).unwrap(), &Method::ALL, None, "file").unwrap();
        assert_eq!(lines.len(), 22);
        let mut seen = vec![of_auto()];
        for line in &lines {
            let style = of(line.method, line.variant);
            assert!(!seen.contains(&style), "{} ({}) looks like another", line.method, line.variant);
            seen.push(style);
        }
        // Without markers too, where lines are told apart by colour and dash.
        let strokes: Vec<_> = seen.iter().map(|s| (s.colour, s.dash)).collect();
        assert!(strokes.iter().enumerate().all(|(i, stroke)| !strokes[..i].contains(stroke)));
    }
}

//! Sparsity pattern of A in several vertex orders.

use crate::report::{Column, Columns, Figure, SparsityPlot};
use limitlab::Result;
use limitlab::mesh::order::{Order, inverse};
use limitlab::schemes::Scheme;

use crate::programs::reproduce::context::{Context, Item, Question};
use crate::programs::reproduce::corpus;

pub const PATTERNS: Item = Item {
    id: "sparsity",
    title: "The pattern of A before and after reordering",
    question: Some(Question {
        asks: "What does the order of the vertices do to the pattern of A?",
        answer: "Reverse Cuthill-McKee gathers its entries in a narrow band; a Morton order gathers most of them, \
                 with far outliers.",
    }),
    run,
};

const ORDERS: [Order; 4] = [Order::File, Order::Rcm, Order::Morton, Order::Random(1)];

fn run(context: &mut Context) -> Result<()> {
    let subject = context.subject(&corpus::SPOT_QUADS)?;
    let system = subject.system(Scheme::CatmullClark)?;
    let mut bandwidths = Vec::new();
    let mut panels = Vec::new();
    let pattern = system.a.pattern();
    for order in ORDERS {
        let place = inverse(&order.order(subject.surface.mesh(), subject.surface.incidence()));
        let entries = || {
            (0..system.len()).flat_map(|i| {
                let place = &place;
                pattern.row(i).iter().map(move |&j| (place[i], place[j as usize]))
            })
        };
        let bandwidth = entries().map(|(i, j)| i.abs_diff(j)).max().unwrap_or(0);
        bandwidths.push((order, bandwidth));
        let caption = format!("{order} order, bandwidth {bandwidth}");
        panels.push(SparsityPlot::new(caption, system.len(), entries()));
    }
    let mut table = Columns::<(Order, u32)>::new()
        .col(Column::key("mesh"), |_| subject.name.clone())
        .col(Column::key("order"), |(order, _)| order.to_string())
        .col(Column::text("vertices"), |_| system.len())
        .col(Column::text("entries"), |_| pattern.columns().len())
        .col(Column::text("bandwidth"), |(_, bandwidth)| *bandwidth)
        .table(PATTERNS.id, PATTERNS.title, &bandwidths);
    table.note("Bandwidth: the largest |i − j| of an entry, vertices numbered in the order.");
    context.table(table)?;
    let entries = pattern.columns().len();
    let mesh = context.caption(&subject);
    let dot = panels.first().map_or(1, SparsityPlot::block);
    let title = format!("{mesh}, catmull-clark: {entries} entries, in dots of {dot}×{dot}");
    let mut figure = Figure::row(panels);
    figure.columns = 2;
    (figure.width, figure.height) = (600, 640);
    context.figure(PATTERNS.id, &figure.title(title))
}

//! What is in the pools, as a table that is put in order by any of its columns.

use std::cmp::Reverse;

use egui::{Grid, RichText, ScrollArea, Sense, Shape, Stroke, Ui, pos2, vec2};

use super::{HudPool, HudTexture, bytes};

/// Rows that are shown of a pool.
const MOST: usize = 100;

/// A column of the table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Column {
    Name,
    #[default]
    Pages,
    Slots,
    Bytes,
}

impl Column {
    const ALL: [Column; 4] = [Column::Name, Column::Pages, Column::Slots, Column::Bytes];

    fn name(self) -> &'static str {
        match self {
            Column::Name => "Texture",
            Column::Pages => "Pages",
            Column::Slots => "Slots",
            Column::Bytes => "Bytes",
        }
    }
}

/// By which column rows are in order. Numbers begin with the largest, names with the first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Order {
    column: Column,
    is_reversed: bool,
}

impl Order {
    fn choose(&mut self, column: Column) {
        *self = Order { column, is_reversed: self.column == column && !self.is_reversed };
    }

    fn sorted(self, textures: &[HudTexture]) -> Vec<&HudTexture> {
        let mut rows: Vec<&HudTexture> = textures.iter().collect();
        match self.column {
            Column::Name => rows.sort_by(|a, b| a.name.cmp(&b.name)),
            Column::Pages => rows.sort_by_key(|row| Reverse(row.pages)),
            Column::Slots => rows.sort_by_key(|row| Reverse(row.slots)),
            Column::Bytes => rows.sort_by_key(|row| Reverse(row.bytes)),
        }
        if self.is_reversed {
            rows.reverse();
        }
        rows
    }
}

pub(super) fn show(ui: &mut Ui, pools: &[HudPool], order: &mut Order) {
    for pool in pools {
        let number = pool.stats.pool.number();
        ui.push_id(("textures", number), |ui| {
            if pools.len() > 1 {
                ui.label(RichText::new(format!("Pool {number}")).small().weak());
            }
            ScrollArea::vertical().max_height(180.0).show(ui, |ui| table(ui, &pool.textures, order));
        });
    }
}

fn table(ui: &mut Ui, textures: &[HudTexture], order: &mut Order) {
    Grid::new("table").num_columns(5).striped(true).spacing([10.0, 2.0]).show(ui, |ui| {
        for column in Column::ALL {
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = 2.0;
                let (is_chosen, label) = (order.column == column, RichText::new(column.name()).small());
                if ui.selectable_label(is_chosen, label).on_hover_text("order by this column").clicked() {
                    order.choose(column);
                }
                if is_chosen {
                    arrow(ui, order.is_reversed == (column == Column::Name));
                }
            });
        }
        ui.label(RichText::new("Levels").small());
        ui.end_row();
        for row in order.sorted(textures).into_iter().take(MOST) {
            let name = egui::Label::new(RichText::new(&row.name).small()).truncate();
            ui.scope(|ui| {
                ui.set_max_width(110.0);
                ui.add(name);
            });
            let [finest, coarsest] = row.levels;
            let cells = [
                row.pages.to_string(),
                row.slots.to_string(),
                bytes(row.bytes),
                format!("{finest} to {coarsest}"),
            ];
            for cell in cells {
                ui.label(RichText::new(cell).small());
            }
            ui.end_row();
        }
    });
    if textures.len() > MOST {
        ui.label(RichText::new(format!("and {} more", textures.len() - MOST)).small().weak());
    }
}

/// A triangle that points down where the largest comes first.
fn arrow(ui: &mut Ui, is_falling: bool) {
    let (rect, _) = ui.allocate_exact_size(vec2(7.0, 6.0), Sense::hover());
    let [wide, tip] = if is_falling { [rect.top(), rect.bottom()] } else { [rect.bottom(), rect.top()] };
    let corners = vec![pos2(rect.left(), wide), pos2(rect.right(), wide), pos2(rect.center().x, tip)];
    let color = ui.visuals().strong_text_color();
    ui.painter().add(Shape::convex_polygon(corners, color, Stroke::NONE));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_column_orders_both_ways() {
        let row = |name: &str, pages, slots, bytes| HudTexture {
            name: name.to_owned(),
            pages,
            slots,
            bytes,
            levels: [0, 3],
        };
        let rows = [row("b", 5, 2, 30), row("a", 7, 1, 20), row("c", 6, 3, 10)];
        let mut order = Order::default();
        let names = |order: Order| order.sorted(&rows).iter().map(|row| &*row.name).collect::<String>();
        assert_eq!(names(order), "acb");
        for (column, first, second) in [
            (Column::Pages, "bca", "acb"),
            (Column::Slots, "cba", "abc"),
            (Column::Bytes, "bac", "cab"),
            (Column::Name, "abc", "cba"),
        ] {
            order.choose(column);
            assert_eq!(names(order), first, "{column:?}");
            order.choose(column);
            assert_eq!(names(order), second, "{column:?}");
        }
    }
}

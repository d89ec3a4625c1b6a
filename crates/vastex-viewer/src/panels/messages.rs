//! What went wrong and what there is to know of a file, told over the picture until a person has read it.

use egui::accesskit::Live;
use egui::{
    Align2, Area, Button, Color32, Context, CornerRadius, Event, Frame, Id, Label, Margin, Order, Rect,
    Response, RichText, Ui, UiBuilder, Vec2,
};

/// Messages that are told at once; of more the newest.
const MOST: usize = 4;
/// What they are written on, the colour of their letters, and their buttons'.
const ERROR: [Color32; 3] =
    [Color32::from_rgb(122, 30, 30), Color32::from_rgb(255, 236, 232), Color32::from_rgb(78, 16, 16)];
const NOTE: [Color32; 3] =
    [Color32::from_rgb(34, 44, 62), Color32::from_rgb(226, 233, 244), Color32::from_rgb(20, 27, 40)];
/// Points that a message is wide at most.
const WIDTH: f32 = 560.0;

/// Errors and notes for the person at the window. A message stays until it is dismissed, or until its owner
/// says that it no longer holds.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Messages {
    /// The oldest first.
    told: Vec<Message>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Message {
    /// What it is about: an error takes the place of all that was said of its topic.
    topic: String,
    text: String,
    /// How often it happened.
    times: u32,
    /// True if nothing went wrong.
    is_note: bool,
}

impl Messages {
    /// Something went wrong. What was said of its topic is replaced, and errors among it are counted.
    pub fn add_error(&mut self, topic: &str, text: impl Into<String>) {
        let before = self.told.iter().find(|message| message.topic == topic && !message.is_note);
        let times = before.map_or(0, |message| message.times);
        self.forget(topic);
        let (topic, text, times) = (topic.to_owned(), text.into(), times.saturating_add(1));
        self.push(Message { topic, text, times, is_note: false });
    }

    /// Adds a note. It becomes a further line of the message on its topic, unless the same text stands there.
    pub fn add_note(&mut self, topic: &str, text: &str) {
        match self.told.iter_mut().find(|message| message.is_note && message.topic == topic) {
            Some(message) if message.text.lines().any(|line| line == text) => {}
            Some(message) => message.text = format!("{}\n{text}", message.text),
            None => {
                let (topic, text) = (topic.to_owned(), text.to_owned());
                self.push(Message { topic, text, times: 1, is_note: true });
            }
        }
    }

    /// Removes all notes: none of them concerns what is shown now.
    pub fn forget_notes(&mut self) {
        self.told.retain(|message| !message.is_note);
    }

    fn push(&mut self, message: Message) {
        self.told.push(message);
        // What went wrong is said rather than what there is to know.
        while self.told.len() > MOST {
            let least = self.told.iter().position(|message| message.is_note).unwrap_or(0);
            self.told.remove(least);
        }
    }

    /// What is said of a topic is no longer so. Returns true if anything was.
    pub fn forget(&mut self, topic: &str) -> bool {
        let count = self.told.len();
        self.told.retain(|message| message.topic != topic);
        self.told.len() < count
    }

    /// Returns true if there is nothing to say.
    pub fn is_empty(&self) -> bool {
        self.told.is_empty()
    }

    /// Shows the messages at the top of `free`, the part of the window that no panel covers, each with a
    /// button that dismisses it.
    pub fn show(&mut self, context: &Context, free: Rect) {
        if self.is_empty() {
            return;
        }
        let width = (free.width() - 32.0).clamp(120.0, WIDTH);
        let place = free.center_top() + Vec2::new(0.0, 12.0);
        let area = Area::new(Id::unique("messages")).pivot(Align2::CENTER_TOP).fixed_pos(place);
        // Over maps of the image.
        let area = area.order(Order::Foreground);
        area.show(context, |ui| {
            let (mut read, mut buttons) = (None, Vec::new());
            // A key that is held would dismiss the next ones, which nobody has read.
            let is_held = |event: &Event| matches!(event, Event::Key { repeat: true, .. });
            let is_repeated = ui.input(|input| input.events.iter().any(is_held));
            for (n, message) in self.told.iter().enumerate() {
                let [ground, letters, button] = if message.is_note { NOTE } else { ERROR };
                let frame = Frame::new()
                    .fill(ground)
                    .corner_radius(CornerRadius::same(4))
                    .inner_margin(Margin::same(8));
                let shown = |ui: &mut Ui| {
                    ui.set_width(width);
                    ui.visuals_mut().override_text_color = Some(letters);
                    let text = ui.add(Label::new(RichText::new(&message.text)).wrap());
                    say_to_readers(&text, if message.is_note { Live::Polite } else { Live::Assertive });
                    ui.horizontal(|ui| {
                        let button = ui.add(Button::new("Dismiss").fill(button));
                        let is_clicked = button.clicked() && !is_repeated;
                        read = read.or(is_clicked.then_some((n, button.has_focus())));
                        buttons.push(button.id);
                        if message.times > 1 {
                            ui.label(RichText::new(format!("happened {} times", message.times)).small());
                        }
                    });
                };
                // By its topic and not by its place: a screen reader says none again, and a button keeps the
                // keys, where a message before it is gone.
                let id = Id::unique(("message", &message.topic, message.is_note));
                ui.scope_builder(UiBuilder::new().scope_id(id), |ui| frame.show(ui, shown));
                ui.add_space(4.0);
            }
            if let Some((read, has_focus)) = read {
                self.told.remove(read);
                buttons.remove(read);
                // The keys stay with messages as long as there are any.
                if let Some(next) = buttons.get(read).or(buttons.last()).filter(|_| has_focus) {
                    ui.memory_mut(|memory| memory.request_focus(*next));
                }
                // The next frame is without it.
                ui.ctx().request_repaint();
            }
        });
    }
}

/// Screen readers say a text that has come or is another one, without being asked.
pub(super) fn say_to_readers(text: &Response, how: Live) {
    text.ctx.accesskit_node_builder(text.id, |node| node.set_live(how));
}

#[cfg(test)]
mod tests {
    use egui::{Ui, pos2};
    use egui_kittest::Harness;
    use egui_kittest::kittest::{NodeT, Queryable};

    use super::*;

    fn shown(messages: Messages) -> Harness<'static, Messages> {
        let show = |ui: &mut Ui, messages: &mut Messages| {
            messages.show(ui.ctx(), Rect::from_min_max(pos2(0.0, 0.0), pos2(800.0, 600.0)));
        };
        Harness::builder().with_size([800.0, 600.0]).build_ui_state(show, messages)
    }

    #[test]
    fn messages_stay_until_they_are_dismissed() {
        let mut messages = Messages::default();
        messages.add_error("a.tif", "a.tif: ends in the middle of a tile");
        messages.add_error("tiles", "level 0 3,4 failed");
        messages.add_error("tiles", "level 0 5,6 failed");
        let mut harness = shown(messages);
        harness.run();
        assert!(harness.query_by_label("level 0 3,4 failed").is_none(), "the last one of a topic");
        assert!(harness.query_by_label("happened 2 times").is_some());
        harness.get_all_by_label("Dismiss").next().unwrap().click();
        harness.run();
        assert!(harness.query_by_label("a.tif: ends in the middle of a tile").is_none());
        assert!(harness.query_by_label("level 0 5,6 failed").is_some());
        assert!(super::super::unnamed(&harness.root()).is_empty());
        assert!(harness.state_mut().forget("tiles") && harness.state().is_empty());
        harness.run();
        assert!(harness.query_by_label("Dismiss").is_none());
    }

    /// A reader says again what comes as another one.
    #[test]
    fn a_message_is_the_same_where_one_before_it_is_gone() {
        let mut messages = Messages::default();
        messages.add_note("a.jpg", "colours are converted");
        messages.add_error("tiles", "level 0 3,4 failed");
        messages.add_note("tiles", "of the second file");
        let mut harness = shown(messages);
        harness.run();
        let ids = |harness: &Harness<'_, Messages>| {
            let id = |text| harness.get_by_label(text).accesskit_node().id();
            ["level 0 3,4 failed", "of the second file"].map(id)
        };
        let before = ids(&harness);
        assert_ne!(before[0], before[1]);
        harness.state_mut().forget("a.jpg");
        harness.run();
        assert_eq!(ids(&harness), before);
        // What went wrong again takes the place of all that was said of it.
        harness.state_mut().add_error("tiles", "level 0 5,6 failed");
        assert_eq!(harness.state().told.len(), 1);
        assert_eq!(harness.state().told[0].times, 2);
    }

    #[test]
    fn messages_are_dismissed_one_after_the_other_by_keys_alone() {
        let mut messages = Messages::default();
        for topic in ["a", "b", "c"] {
            messages.add_error(topic, format!("{topic} failed"));
        }
        let mut harness = shown(messages);
        harness.run();
        harness.get_all_by_label("Dismiss").nth(1).unwrap().focus();
        harness.run();
        let key = |pressed, repeat| egui::Event::Key {
            key: egui::Key::Space,
            physical_key: None,
            pressed,
            repeat,
            modifiers: egui::Modifiers::NONE,
        };
        for left in [&["a", "c"][..], &["a"], &[]] {
            // A key that is held dismisses one.
            for event in [key(true, false), key(true, true), key(true, true), key(false, false)] {
                harness.event(event);
                harness.run();
                let topics: Vec<&str> = harness.state().told.iter().map(|message| &*message.topic).collect();
                assert_eq!(topics, left);
            }
        }
    }

    /// As of a picture that cannot be written and a camera path that makes no sense.
    #[test]
    fn what_went_wrong_of_one_thing_does_not_hide_what_went_wrong_of_another() {
        let mut messages = Messages::default();
        messages.add_error("picture", "no picture was written: the disk is full");
        messages.add_error("camera path", "flight.path: line 3: a time is no number");
        let mut harness = shown(messages);
        // A minute of frames.
        (0..60).for_each(|_| harness.run_steps(1));
        let both = ["no picture was written: the disk is full", "flight.path: line 3: a time is no number"];
        for text in both {
            assert!(harness.query_by_label(text).is_some(), "{text}");
        }
        harness.state_mut().forget("picture");
        harness.run();
        assert!(harness.query_by_label(both[0]).is_none() && harness.query_by_label(both[1]).is_some());
    }

    #[test]
    fn notes_of_a_topic_stand_together_and_go_with_what_they_are_of() {
        let mut messages = Messages::default();
        for note in ["the whole image is held in memory", "colours are converted"].repeat(2) {
            messages.add_note("a.jpg", note);
        }
        messages.add_error("tiles", "level 0 3,4 failed");
        let mut harness = shown(messages);
        harness.run();
        let live = |text: &str| harness.get_by_label(text).accesskit_node().live();
        // A screen reader says both, what went wrong at once.
        assert_eq!(live("the whole image is held in memory\ncolours are converted"), Live::Polite);
        assert_eq!(live("level 0 3,4 failed"), Live::Assertive);
        assert_eq!(harness.get_all_by_label("Dismiss").count(), 2);
        assert!(super::super::unnamed(&harness.root()).is_empty());
        harness.state_mut().forget_notes();
        harness.run();
        assert!(harness.query_by_label("level 0 3,4 failed").is_some(), "what went wrong stays");
        assert_eq!(harness.get_all_by_label("Dismiss").count(), 1);
        // Of too many, notes go first.
        harness.state_mut().add_note("b.jpg", "only the first image of the file is read");
        (0..MOST).for_each(|n| harness.state_mut().add_error(&n.to_string(), format!("file {n}")));
        assert!(harness.state().told.iter().all(|message| !message.is_note));
    }

    #[test]
    fn there_are_no_more_than_can_be_read() {
        let mut messages = Messages::default();
        (0..9).for_each(|n| messages.add_error(&n.to_string(), format!("file {n}")));
        assert_eq!(messages.told.len(), MOST);
        assert_eq!(messages.told.last().map(|message| &*message.text), Some("file 8"));
        assert!(!messages.forget("0"));
    }
}

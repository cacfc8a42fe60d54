// No labels of hairs.

fn begin_labels(pixel: vec2u) {}

fn label_piece(one: Fragment) {}

fn put_label(pixel: vec2u) {}

fn hand_labels_over(lane: u32) {}

fn take_labels_over(lane: u32) {}

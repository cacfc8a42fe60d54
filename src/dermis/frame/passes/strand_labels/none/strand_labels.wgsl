// No labels of hairs.

fn begin_labels(pixel: vec2u) {}

fn label_piece(one: Fragment) {}

fn put_label(pixel: vec2u) {}

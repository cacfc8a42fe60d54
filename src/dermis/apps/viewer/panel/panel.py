"""Control panel at the left of the window, drawn with Dear ImGui, and overlays on the picture."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from imgui_bundle import imgui

from dermis.apps.viewer.controls import Event, SplitView
from dermis.apps.viewer.panel.fields import draw_button, record_position, run_action
from dermis.apps.viewer.panel.imgui_frames import (
    POINTER_EVENTS,
    ImguiFrames,
    feed_key,
    feed_pointer,
    recover_imgui,
)
from dermis.apps.viewer.panel.sections import SECTIONS
from dermis.apps.viewer.session import Session
from dermis.gpu import Device, TextureView

HELP_KEYS = ("?", "h", "H", "F1")
"""Keys that show and hide the list of shortcuts."""

PLAY_KEY = " "
"""Key that plays and pauses the motion."""

SHORTCUTS = (
    ("drag", "orbit the head"),
    ("right drag, two fingers", "pan"),
    ("wheel, pinch", "zoom"),
    ("double click", "orbit around that point"),
    ("Shift and drag", "move the selected light or the environment"),
    ("1 2 3 4 5 6", "portrait, three-quarter, profile, ear, cheek, full_body"),
    ("space", "play or pause the motion"),
    ("Ctrl+Z, Ctrl+Y", "undo, redo"),
    ("Ctrl and click", "type a slider's value"),
    ("Ctrl+S", "save the scene"),
    ("Tab", "hide or show the panel"),
    ("Escape", "close a list or this help, clear the search"),
    ("? or H", "hide or show this help"),
)
_MESSAGE_MARGIN, _MIN_MESSAGE_WIDTH = 10.0, 80.0
_DIVIDER_HANDLE_RADIUS = 7.0  # of the divider
_HELP_WIDTH, _SHORTCUT_COLUMN_FRACTION = 460.0, 0.4


def draw_divider(split_view: SplitView, picture_left: float, window_size: tuple[float, float]) -> None:
    """Draw the divider of the before/after comparison, with a handle in its centre.

    picture_left : left edge of the picture
    window_size : width and height of the window [logical pixel]
    """
    if split_view.frozen_state is None:
        return
    draw_list, x = (
        imgui.get_background_draw_list(),
        picture_left + split_view.divider_position * (window_size[0] - picture_left),
    )
    light, dark = imgui.IM_COL32(230, 230, 230, 255), imgui.IM_COL32(0, 0, 0, 255)
    draw_list.add_line(imgui.ImVec2(x, 0.0), imgui.ImVec2(x, window_size[1]), light, 1.0)
    middle = imgui.ImVec2(x, 0.5 * window_size[1])
    draw_list.add_circle_filled(middle, _DIVIDER_HANDLE_RADIUS, light)
    draw_list.add_circle(middle, _DIVIDER_HANDLE_RADIUS, dark)
    for text, start in (
        ("before", x - imgui.calc_text_size("before").x - _MESSAGE_MARGIN),
        ("after", x + _MESSAGE_MARGIN),
    ):
        draw_list.add_text(imgui.ImVec2(start + 1.0, _MESSAGE_MARGIN + 1.0), dark, text)
        draw_list.add_text(imgui.ImVec2(start, _MESSAGE_MARGIN), light, text)


def draw_messages(
    message_lines: Sequence[str], picture_left: float, window_size: tuple[float, float]
) -> None:
    """Draw lines of text on a dark background along the lower edge of the picture.

    picture_left : left edge of the picture
    window_size : width and height of the window [logical pixel]
    """
    if not message_lines:
        return
    draw_list = imgui.get_foreground_draw_list()
    picture_left += _MESSAGE_MARGIN
    wrap_width = max(_MIN_MESSAGE_WIDTH, window_size[0] - picture_left - _MESSAGE_MARGIN)
    text = "\n".join(message_lines)
    box = imgui.calc_text_size(text, False, wrap_width)
    top = window_size[1] - box.y - _MESSAGE_MARGIN
    background, white = imgui.IM_COL32(0, 0, 0, 150), imgui.IM_COL32(235, 235, 235, 255)
    corners = (
        imgui.ImVec2(picture_left - 6, top - 4),
        imgui.ImVec2(picture_left + box.x + 6, window_size[1] - 6),
    )
    draw_list.add_rect_filled(*corners, background, 4.0)
    font, start = imgui.get_font(), imgui.ImVec2(picture_left, top)
    draw_list.add_text(font, imgui.get_font_size(), start, white, text, wrap_width)


def draw_help(picture_left: float, window_size: tuple[float, float]) -> None:
    """Draw the list of shortcuts in the centre of the picture; the list does not react to the pointer.

    picture_left : left edge of the picture
    window_size : width and height of the window [logical pixel]
    """
    width = min(_HELP_WIDTH, window_size[0] - picture_left - 2.0 * _MESSAGE_MARGIN)
    imgui.set_next_window_pos(
        imgui.ImVec2(0.5 * (picture_left + window_size[0]), 0.5 * window_size[1]), 0, imgui.ImVec2(0.5, 0.5)
    )
    imgui.set_next_window_size(imgui.ImVec2(width, 0.0))
    imgui.set_next_window_bg_alpha(0.88)
    flags = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_inputs | imgui.WindowFlags_.no_nav
    imgui.begin("shortcuts", None, int(flags))
    if imgui.begin_table("shortcuts", 2, int(imgui.TableFlags_.sizing_stretch_prop)):
        stretch = int(imgui.TableColumnFlags_.width_stretch)
        imgui.table_setup_column("input", stretch, _SHORTCUT_COLUMN_FRACTION)
        imgui.table_setup_column("action", stretch, 1.0 - _SHORTCUT_COLUMN_FRACTION)
        for text in (text for row in SHORTCUTS for text in row):
            imgui.table_next_column()
            imgui.text_wrapped(text)
        imgui.end_table()
    imgui.end()


_PANEL_WIDTH = 330.0  # logical
_CONTROL_WIDTH_FRACTION = 0.5  # of the panel's width
_MAX_PANEL_WIDTH_FRACTION = 0.5  # of the window
_MIN_TEXT_SCALE = 0.8  # in a narrow panel
_NARROW_WINDOW_WIDTH = 400.0  # width below which a window has a drawer
_PHONE_WINDOW_WIDTH = 480.0  # width below which an upright phone has a drawer
_MIN_PORTRAIT_ASPECT = 1.4  # least height over width of an upright phone
_DRAWER_WIDTH_FRACTION = 0.86  # of the window's width
_TOUCH_PADDING = 8.0  # vertical padding of controls for fingers
_PANEL_BUTTON_MARGIN, _PANEL_BUTTON_ALPHA = 8.0, 0.6  # of the button that opens the panel


class Panel:
    """Control panel with its sections.

    The panel processes the input events that concern it, and leaves all others to the picture.

    is_visible : whether a wide window shows the panel beside the picture
    is_drawer_open : whether a narrow window shows the panel as a drawer over the picture
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self.is_visible, self.is_drawer_open, self.shows_help = True, False, False
        self._size = (0.0, 0.0)
        self._has_popup = self._scrolls = False
        self._button_end = (0.0, 0.0)
        self._frames = ImguiFrames(partial(session.report_error, "The panel cannot be drawn"))
        self.label_width = 0.0  # space right of the controls [logical pixel]

    def open(self, device: Device, target_format: str) -> None:
        """Create the resources that draw the panel.

        target_format : format of the textures to draw into
        """
        self._frames.open(device, target_format)

    def width(self, window_size: tuple[float, float]) -> float:
        """Return the width that the panel takes away from the picture, 0 for a drawer [logical pixel].

        window_size : width and height of the window [logical pixel]
        """
        return 0.0 if is_drawer(window_size) else self._covered_width(window_size)

    def _covered_width(self, window_size: tuple[float, float]) -> float:
        """Return the width of the part of the window that the panel covers, 0 if hidden [logical pixel].

        window_size : width and height of the window [logical pixel]
        """
        fraction, is_shown = _MAX_PANEL_WIDTH_FRACTION, self.is_visible
        if is_drawer(window_size):
            fraction, is_shown = _DRAWER_WIDTH_FRACTION, self.is_drawer_open
        return round(min(_PANEL_WIDTH, fraction * window_size[0])) if is_shown else 0.0

    def toggle(self) -> None:
        """Show or hide the panel."""
        if is_drawer(self._size):
            self.is_drawer_open = not self.is_drawer_open
        else:
            self.is_visible = not self.is_visible

    def handle_event(self, event: Event, window_size: tuple[float, float]) -> bool:
        """Process an input event if it concerns the panel; return False if it concerns the picture.

        window_size : width and height of the window [logical pixel]
        """
        self._frames.make_context_current()
        self._size = window_size
        io, kind = imgui.get_io(), event["event_type"]
        if kind == "key_down" and not io.want_text_input and self._run_shortcut(event):
            return True
        if kind == "pointer_down" and event["x"] >= self._covered_width(window_size):
            self.shows_help = False
        if kind in POINTER_EVENTS:
            is_on_panel = self._is_over_panel(
                event["x"], event["y"], window_size
            )  # evaluated before a press closes a list
            feed_pointer(event, lambda: self._lay_out_frame(window_size))
            return is_on_panel
        if kind == "pointer_leave":
            io.add_mouse_pos_event(-1e6, -1e6)
            return False
        feed_key(event, lambda: self._lay_out_frame(window_size))
        return bool(imgui.get_io().want_text_input)  # of the current context, which the frame may replace

    def draw(self, target_view: TextureView, window_size: tuple[float, float], pixel_ratio: float) -> None:
        """Draw the panel over the content of the target.

        window_size : width and height of the window [logical pixel]
        pixel_ratio : number of physical pixels per logical pixel, in one direction
        """
        self._frames.make_context_current()
        imgui.get_io().display_framebuffer_scale = imgui.ImVec2(pixel_ratio, pixel_ratio)
        self._lay_out_frame(window_size)
        self._frames.render(target_view)

    def _lay_out_frame(self, window_size: tuple[float, float]) -> None:
        self._size = window_size
        self._frames.lay_out(window_size, lambda: self._draw_windows(window_size))

    def _run_shortcut(self, event: Event) -> bool:
        """Run the shortcut of a pressed key; return False if the key has no shortcut."""
        key, session = str(event["key"]), self._session
        if {"Control", "Meta"} & set(event.get("modifiers", ())):
            if key.lower() != "s":
                return False
            run_action(session, lambda: session.save(Path(session.scene_file)))
        elif key == "Tab":
            self.toggle()
        elif key == "Escape":
            return self._close_topmost()
        elif key in HELP_KEYS:
            self.shows_help = not self.shows_help
        elif key == PLAY_KEY and session.player.clip is not None:
            session.player.toggle()
        else:
            return False
        return True

    def _close_topmost(self) -> bool:
        """Close the popup; without a popup, close the help; without help, clear the search text.

        The result is False if there was neither a popup nor help nor search text.
        """
        if self._has_popup:
            imgui.internal.close_popup_to_level(0, False)
            self._has_popup = False
        elif self.shows_help:
            self.shows_help = False
        elif self._session.search:
            self._session.search = ""
        else:
            return False
        return True

    def _is_over_panel(self, x: float, y: float, window_size: tuple[float, float]) -> bool:
        """Return whether the pointer is over the panel, its button or a popup.

        x, y : position of the pointer in the window
        window_size : width and height of the window [logical pixel]
        """
        width = self._covered_width(window_size)
        on_button = not width and x < self._button_end[0] and y < self._button_end[1]
        return x < width or on_button or self._has_popup or bool(imgui.is_any_item_active())

    def _draw_windows(self, window_size: tuple[float, float]) -> None:
        """Draw the panel (or, if it is hidden, the button that opens it) and the overlays."""
        vertical_padding = _TOUCH_PADDING if is_drawer(window_size) else imgui.get_style().frame_padding.y
        padding = imgui.ImVec2(imgui.get_style().frame_padding.x, vertical_padding)
        imgui.push_style_var(int(imgui.StyleVar_.frame_padding), padding)
        if self._covered_width(window_size):
            self._draw_panel(window_size)
        else:
            self._draw_panel_button()
        imgui.pop_style_var()
        left, session = self.width(window_size), self._session
        if self.shows_help:
            draw_help(left, window_size)
        draw_divider(session.split, left, window_size)
        status = "" if self._covered_width(window_size) > left else session.status
        draw_messages(
            [line for line in (session.message, session.heads.loading_message, status) if line],
            left,
            window_size,
        )

    def _draw_panel_button(self) -> None:
        """Draw the button in the corner of the picture that opens the panel."""
        self._has_popup = False
        imgui.set_next_window_pos(imgui.ImVec2(0.0, 0.0))
        flags = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_background
        imgui.push_style_var(int(imgui.StyleVar_.alpha), _PANEL_BUTTON_ALPHA)
        imgui.begin("corner", None, int(flags | imgui.WindowFlags_.always_auto_resize))
        if draw_button(self._session, "panel"):
            self.toggle()
        end = imgui.get_item_rect_max()
        self._button_end = float(end.x) + _PANEL_BUTTON_MARGIN, float(end.y) + _PANEL_BUTTON_MARGIN
        imgui.end()
        imgui.pop_style_var()

    def _draw_panel(self, window_size: tuple[float, float]) -> None:
        session, width = self._session, self._covered_width(window_size)
        imgui.get_style().font_scale_main = max(_MIN_TEXT_SCALE, min(1.0, width / _PANEL_WIDTH))
        imgui.set_next_window_pos(imgui.ImVec2(0.0, 0.0))
        imgui.set_next_window_size(imgui.ImVec2(width, window_size[1]))
        fixed = imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_resize | imgui.WindowFlags_.no_collapse
        imgui.begin("dermis", None, int(fixed | imgui.WindowFlags_.no_title_bar))
        self._draw_toolbar()
        imgui.push_item_width(_CONTROL_WIDTH_FRACTION * width)
        gap = imgui.get_style().item_inner_spacing.x
        self.label_width = imgui.get_content_region_avail().x - _CONTROL_WIDTH_FRACTION * width - gap
        for section in filter(lambda section: section.applies(session), SECTIONS):
            flags = int(imgui.TreeNodeFlags_.default_open) if section.is_open else 0
            is_open = imgui.collapsing_header(section.title, flags)
            record_position(session, section.title)
            if is_open:
                imgui.push_id(section.title)  # labels may occur in several sections
                with recover_imgui(partial(session.report_error, f"{section.title} cannot be drawn")):
                    section.draw(session)
                imgui.pop_id()
        imgui.pop_item_width()
        self._scroll_by_touch()
        self._has_popup = bool(imgui.is_popup_open("", int(imgui.PopupFlags_.any_popup)))
        imgui.end()

    def _draw_toolbar(self) -> None:
        history = self._session.history
        undo, redo = ("undo", history.can_undo, history.undo), ("redo", history.can_redo, history.redo)
        for label, is_possible, action in (undo, redo):
            imgui.begin_disabled(not is_possible)
            if draw_button(self._session, label):
                action()
            imgui.end_disabled()
            imgui.same_line()
        self.shows_help ^= draw_button(self._session, "help")
        imgui.same_line()
        if draw_button(self._session, "hide"):
            self.toggle()

    def _scroll_by_touch(self) -> None:
        """Scroll the panel by a drag that began outside all controls, for touch screens without a wheel."""
        if imgui.is_mouse_clicked(0):
            self._scrolls = imgui.is_window_hovered() and not imgui.is_any_item_hovered()
        if self._scrolls and imgui.is_mouse_down(0):
            imgui.set_scroll_y(imgui.get_scroll_y() - imgui.get_io().mouse_delta.y)


def is_drawer(window_size: tuple[float, float]) -> bool:
    """Return whether a window is so narrow that the panel is a drawer over the picture."""
    width, height = window_size
    return width < (_PHONE_WINDOW_WIDTH if height > _MIN_PORTRAIT_ASPECT * width else _NARROW_WINDOW_WIDTH)

# SPDX-License-Identifier: Apache-2.0
"""The add-on's user interface: preferences, scene settings, operators and panels."""
# Without `from __future__ import annotations`: Blender reads the annotations of properties.
import textwrap
import time
from contextlib import suppress
from typing import Any

import bpy

from . import jobs, program
from ._cycles import GROUPS, OLDEST, blender, changed
from .errors import Error

DENOISE = (("auto", "Default", "Independent samples, denoised wherever held-out samples find less error, guided by "
                               "Cycles' albedo and normal; Open Image Denoise takes part where the program finds it"),
           ("none", "None", "Control variates alone: half of the samples have common random numbers"),
           ("bias", "Least Bias", "Denoised where held-out samples find hardly any bias"),
           ("balanced", "Balanced", "Between least bias and least error"),
           ("error", "Least Error", "Denoised wherever held-out samples find less error; Open Image Denoise takes part "
                                    "where the program finds it"))


def whole_groups(choice: Any, context: Any) -> None:
    """Rounds the number of samples to a multiple of the groups."""
    share = 2 * GROUPS
    rounded = -(-choice.samples // share) * share
    if choice.samples != rounded:
        choice.samples = rounded


class Choice(bpy.types.PropertyGroup):  # type: ignore[misc,name-defined,unused-ignore]
    """Settings of a scene."""

    samples: bpy.props.IntProperty(  # type: ignore[valid-type,unused-ignore]
        name="Samples", default=192, min=6 * GROUPS, max=240000, step=2 * GROUPS, update=whole_groups,
        description="Samples per pixel of all groups together, a multiple of 24")
    seed: bpy.props.IntProperty(  # type: ignore[valid-type,unused-ignore]
        name="Seed", default=0, min=0, max=8000, description="Another one, other samples")
    denoise: bpy.props.EnumProperty(  # type: ignore[valid-type,unused-ignore]
        name="Denoise", items=DENOISE, default="auto")


class State(bpy.types.PropertyGroup):  # type: ignore[misc,name-defined,unused-ignore]
    """State in the window manager: the running job, and the last one's message. Not saved in files."""

    running: bpy.props.BoolProperty()  # type: ignore[valid-type,unused-ignore]
    cancel: bpy.props.BoolProperty()  # type: ignore[valid-type,unused-ignore]
    progress: bpy.props.FloatProperty(  # type: ignore[valid-type,unused-ignore]
        name="Progress", subtype="PERCENTAGE", min=0, max=100, precision=0)
    text: bpy.props.StringProperty()  # type: ignore[valid-type,unused-ignore]


class Preferences(bpy.types.AddonPreferences):  # type: ignore[misc,name-defined,unused-ignore]
    bl_idname = __package__

    program: bpy.props.StringProperty(  # type: ignore[valid-type,unused-ignore]
        name="Program", subtype="FILE_PATH", description="Path of the program covary; empty: that of the add-on, or of "
                                                         "the search path")

    def draw(self, context: Any) -> None:
        self.layout.prop(self, "program")
        try:
            wrapped(self.layout, context, f"Found: {program.find(self.program)}", "CHECKMARK")
        except Error as error:
            wrapped(self.layout, context, str(error), "ERROR")


def named_program(context: Any) -> str:
    """The program of the preferences."""
    return str(context.preferences.addons[__package__].preferences.program)


def wrapped(layout: Any, context: Any, text: str, icon: str = "NONE") -> None:
    """Text in as many lines as the region's width needs."""
    width = context.region.width / context.preferences.system.ui_scale
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(textwrap.wrap(text, max(16, int((width - 70) / 6.3)))):
        column.label(text=line, icon=icon if number == 0 else "NONE" if icon == "NONE" else "BLANK1")


class RENDER_OT_covary(bpy.types.Operator):  # type: ignore[misc,name-defined,unused-ignore]
    bl_idname = "render.covary"
    bl_label = "Render Image"
    bl_description = ("Render groups of samples and make one picture of them, with its predicted error; Esc cancels")

    animation: bpy.props.BoolProperty(  # type: ignore[valid-type,unused-ignore]
        name="Animation", description="All frames of the scene's range", options={"SKIP_SAVE"})

    def execute(self, context: Any) -> set[str]:
        """Without a window: runs to the end."""
        self.step = None
        try:
            self._prepare(context)
            for self.step in self.steps:
                self.step.begin(window=False)
                self._end_step()
        except Exception as error:  # noqa: BLE001  Blender shows the text
            return self._failed(context, error)
        return self._finished(context)

    def invoke(self, context: Any, event: Any) -> set[str]:
        """With a window: one step at a time."""
        if context.window_manager.covary.running:
            self.report({"ERROR"}, "covary: renders already")
            return {"CANCELLED"}
        self.step = None
        try:
            self._prepare(context)
        except Exception as error:  # noqa: BLE001
            return self._failed(context, error)
        # Before another window opens: it would become the operator's, and closing it would end the operator.
        self.timer = context.window_manager.event_timer_add(0.1, window=context.window)
        context.window_manager.modal_handler_add(self)
        self._open_window(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        state = context.window_manager.covary
        if event.type == "ESC" and event.value == "PRESS":
            state.cancel = True
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            if self.step is not None and not self.step.ended():
                if not (state.cancel and isinstance(self.step, jobs.Combining)):
                    return {"PASS_THROUGH"}
            if state.cancel:
                raise jobs.Cancelled
            if self.step is not None:
                self._end_step()
            self._show_progress(context)
            self.step = next(self.steps, None)
            if self.step is None:
                return self._finished(context)
            self.step.begin(window=True)
            return {"PASS_THROUGH"}
        except Exception as error:  # noqa: BLE001
            return self._failed(context, error)

    def _prepare(self, context: Any) -> None:
        state = context.window_manager.covary
        state.running, state.cancel, state.progress, state.text = True, False, 0, ""
        self.steps, self.timer, self.display, self.started = iter(()), None, "", time.perf_counter()
        self.frame = context.scene.frame_current
        self.job = jobs.Job(context.scene, named_program(context), self.animation)
        self.notices = [f"{name} was {value!r}, rendered with {other!r}: {reason}"
                        for name, value, other, reason in changed(context.scene)]
        self.steps = self.job.steps()

    def _open_window(self, context: Any) -> None:
        """Opens the window where Blender shows renders, once, because each group would bring it to the front again."""
        view = context.preferences.view
        if view.render_display_type != "NONE":
            bpy.ops.render.view_show("INVOKE_DEFAULT")
            self.display, view.render_display_type = view.render_display_type, "NONE"

    def _end_step(self) -> None:
        step, self.step = self.step, None
        step.close()
        step.check()

    def _show_progress(self, context: Any) -> None:
        state, job = context.window_manager.covary, self.job
        state.progress, state.text = 100 * job.done / job.total, job.text()
        if context.workspace:
            context.workspace.status_text_set(f"covary: {job.text()}   Esc: cancel")
        redraw(context)

    def _release(self, context: Any) -> None:
        """Restores everything, however the job ended."""
        if self.step is not None:
            self.step.close()
        self.steps.close() if hasattr(self.steps, "close") else None
        if self.timer is not None:
            context.window_manager.event_timer_remove(self.timer)
        if self.display:
            context.preferences.view.render_display_type = self.display
        if self.animation and context.scene.frame_current != self.frame:
            context.scene.frame_set(self.frame)
        if context.workspace:
            context.workspace.status_text_set(None)
        context.window_manager.covary.running = False

    def _failed(self, context: Any, error: Exception) -> set[str]:
        with suppress(Exception):
            self._release(context)
        cancelled = isinstance(error, jobs.Cancelled)
        text = "Cancelled; the settings are as before" if cancelled else str(error).strip().removeprefix("Error: ")
        context.window_manager.covary.text = text
        self.report({"INFO" if cancelled else "ERROR"}, f"covary: {text}")
        redraw(context)
        return {"CANCELLED"}

    def _finished(self, context: Any) -> set[str]:
        self._release(context)
        seconds = time.perf_counter() - self.started
        jobs.show(self.job.output)
        for warning in self.notices + self.job.warnings:
            self.report({"WARNING"}, f"covary: {warning}")
        text = f"Saved {self.job.output} after {seconds:.0f} s. {self.job.verdict}".strip()
        context.window_manager.covary.text = text
        self.report({"INFO"}, f"covary: {text}")
        redraw(context)
        return {"FINISHED"}


class RENDER_OT_covary_cancel(bpy.types.Operator):  # type: ignore[misc,name-defined,unused-ignore]
    bl_idname = "render.covary_cancel"
    bl_label = "Cancel"
    bl_description = "End after the group that is rendered now"

    def execute(self, context: Any) -> set[str]:
        context.window_manager.covary.cancel = True
        return {"FINISHED"}


class OfCycles:
    """What both panels share."""

    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "render"
    COMPAT_ENGINES = {"CYCLES"}

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.engine in cls.COMPAT_ENGINES


class RENDER_PT_covary(OfCycles, bpy.types.Panel):  # type: ignore[misc,name-defined,unused-ignore]
    bl_label = "covary"

    def draw(self, context: Any) -> None:
        layout, state = self.layout, context.window_manager.covary
        layout.use_property_split, layout.use_property_decorate = True, False
        for name in ("samples", "seed", "denoise"):
            layout.prop(context.scene.covary, name)
        if state.running:
            row = layout.row(align=True)
            row.use_property_split = False
            row.prop(state, "progress", text=state.text, slider=True)
            row.operator(RENDER_OT_covary_cancel.bl_idname, text="", icon="X")
            return
        try:
            blender()
            program.find(named_program(context))
        except Error as error:
            wrapped(layout, context, str(error), "ERROR")
            return
        column = layout.column(align=True)
        column.operator(RENDER_OT_covary.bl_idname, icon="RENDER_STILL")
        column.operator(RENDER_OT_covary.bl_idname, text="Render Animation", icon="RENDER_ANIMATION").animation = True
        if state.text:
            wrapped(layout, context, state.text, "INFO")


class RENDER_PT_covary_changes(OfCycles, bpy.types.Panel):  # type: ignore[misc,name-defined,unused-ignore]
    bl_label = "Changed Settings"
    bl_parent_id = "RENDER_PT_covary"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: Any) -> bool:
        return super().poll(context) and bpy.app.version >= OLDEST

    def draw(self, context: Any) -> None:
        found = changed(context.scene)
        for name, value, other, reason in found:
            wrapped(self.layout, context, f"{name}: {value!r} becomes {other!r}; {reason}", "DOT")
        if not found:
            self.layout.label(text="Nothing that changes the picture")


def of_menu(menu: Any, context: Any) -> None:
    """The entries in the menu Render, with Cycles."""
    if context.engine in OfCycles.COMPAT_ENGINES:
        name = RENDER_OT_covary.bl_idname
        menu.layout.separator()
        menu.layout.operator(name, text="Render Image with covary")
        menu.layout.operator(name, text="Render Animation with covary").animation = True


def redraw(context: Any) -> None:
    """The properties editors of all windows."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "PROPERTIES":
                area.tag_redraw()


CLASSES = (Choice, State, Preferences, RENDER_OT_covary, RENDER_OT_covary_cancel, RENDER_PT_covary,
           RENDER_PT_covary_changes)


def register() -> None:
    """Adds the operators, the panels, and the properties `covary` of scenes and of the window manager."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.covary = bpy.props.PointerProperty(type=Choice)
    bpy.types.WindowManager.covary = bpy.props.PointerProperty(type=State)
    bpy.types.TOPBAR_MT_render.append(of_menu)


def unregister() -> None:
    """Removes them."""
    bpy.types.TOPBAR_MT_render.remove(of_menu)
    del bpy.types.Scene.covary
    del bpy.types.WindowManager.covary
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)

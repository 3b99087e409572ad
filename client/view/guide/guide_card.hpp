// The card of the guided first minute. It shows the task of the present step, always at the lower left of the window.
#pragma once

#include <imgui.h>

#include <string>

#include "client/view/guide/guide.hpp"

namespace tandem::client {

/// Button that the user has pressed on the card.
enum class GuideAction : std::uint8_t { kNone, kSkip, kEnd, kOpenScene };

struct GuideCard {
  GuideStep step = GuideStep::kTouch;
  bool is_mouse = true;
  bool is_in_scene = true;  ///< false: the session displays a scene that is not kGuideScene
};

/// Title and task of a step for the user.
std::string guide_title(GuideStep step);
const char* guide_text(GuideStep step, bool is_mouse);

/// Returns the area of the card: left, top, right, bottom [px]. It is the same for all steps.
/// In      free_width  width of the window without the panels
ImVec4 guide_place(float free_width);
/// Draws the card in the current ImGui context.
/// Thread  the one that runs the window
GuideAction draw_guide(const GuideCard& card, float free_width);

}  // namespace tandem::client

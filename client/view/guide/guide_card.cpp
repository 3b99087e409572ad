#include "client/view/guide/guide_card.hpp"

#include <algorithm>
#include <array>

#include "client/view/screen/style.hpp"

namespace tandem::client {
namespace {

constexpr float kMaxCardEm = 30;

struct StepText {
  const char* title;
  const char* with_mouse;
  const char* with_device;  ///< text for users with a haptic device
};

/// Indexed by GuideStep.
constexpr std::array<StepText, kGuideTasks + 1> kTexts{{
    {"Touch the crate", "Drag down with the left mouse button, until your hand presses on the orange crate.",
     "Move your hand down, until it presses on the orange crate."},
    {"Grab it", "Double click, or press Space. The crate now follows your hand.",
     "Press the button of your device. The crate now follows your hand."},
    {"Lift it together", "Drag up. Your partner lifts the other end; for one hand it is too heavy.",
     "Move up. Your partner lifts the other end; for one hand it is too heavy."},
    {"Add a delay", "In the panel (Tab shows it), move the slider under Delay to 200 ms.",
     "In the panel (Tab shows it), move the slider under Delay to 200 ms."},
    {"Feel the delay", "Move the crate, or press on something. Touch is as firm as before: a model here predicts it.",
     "Move the crate, or press on something. Touch is as firm as before: a model here predicts it."},
    {"Choose another stage", "In the panel under Stage, choose hold. It predicts nothing.",
     "In the panel under Stage, choose hold. It predicts nothing."},
    {"Compare", "Move and press again. Each force comes late, and the crate drags and rings.",
     "Move and press again. Each force comes late, and the crate drags and rings."},
    {"Back to the start", "Choose local-model under Stage, and move the slider under Delay to 0.",
     "Choose local-model under Stage, and move the slider under Delay to 0."},
    {"That is all", "Open other scenes, or host for others, in the menu Session. F1 lists all keys.",
     "Open other scenes, or host for others, in the menu Session. F1 lists all keys."},
}};
constexpr const char* kElsewhere = "The guided first minute takes place in the scene with the crate.";

float em() {
  return ImGui::GetFontSize();
}

/// Returns the height of the tallest task text, wrapped to this width.
float text_height(float width) {
  float height = 0;
  for (const StepText& text : kTexts) {
    for (const char* const task : {text.with_mouse, text.with_device}) {
      height = std::max(height, ImGui::CalcTextSize(task, nullptr, false, width).y);
    }
  }
  return height;
}

GuideAction draw_buttons(const GuideCard& card) {
  if (!card.is_in_scene) {
    if (ImGui::Button("Open it")) return GuideAction::kOpenScene;
    ImGui::SameLine();
    return ImGui::Button("Not now") ? GuideAction::kEnd : GuideAction::kNone;
  }
  if (card.step == GuideStep::kEnd) return ImGui::Button("Done") ? GuideAction::kEnd : GuideAction::kNone;
  if (ImGui::Button("Skip this step")) return GuideAction::kSkip;
  ImGui::SameLine();
  return ImGui::Button("End the guide") ? GuideAction::kEnd : GuideAction::kNone;
}

}  // namespace

std::string guide_title(GuideStep step) {
  const auto index = static_cast<std::size_t>(step);
  const std::string title = kTexts.at(index).title;
  if (step == GuideStep::kEnd) return title;
  return "Step " + std::to_string(index + 1) + " of " + std::to_string(kGuideTasks) + ": " + title;
}

const char* guide_text(GuideStep step, bool is_mouse) {
  const StepText& text = kTexts.at(static_cast<std::size_t>(step));
  return is_mouse ? text.with_mouse : text.with_device;
}

ImVec4 guide_place(float free_width) {
  const ImGuiStyle& style = ImGui::GetStyle();
  const float width = std::min(kMaxCardEm * em(), free_width - 1.2F * em());
  const float text = text_height(width - 2 * style.WindowPadding.x);
  const float height = text + ImGui::GetTextLineHeightWithSpacing() + style.ItemSpacing.y + ImGui::GetFrameHeight() +
                       2 * style.WindowPadding.y;
  const float bottom = ImGui::GetIO().DisplaySize.y - 0.6F * em();
  return {0.6F * em(), bottom - height, 0.6F * em() + width, bottom};
}

GuideAction draw_guide(const GuideCard& card, float free_width) {
  const ImVec4 place = guide_place(free_width);
  ImGui::SetNextWindowPos(ImVec2(place.x, place.y));
  ImGui::SetNextWindowSize(ImVec2(place.z - place.x, place.w - place.y));
  // The card must not take the focus when it appears, because this would close an open menu.
  ImGui::Begin("##guide", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoFocusOnAppearing);
  const std::string title = card.is_in_scene ? guide_title(card.step) : "Guided first minute";
  ImGui::TextColored(kTitle, "%s", title.c_str());
  draw_explanation(card.is_in_scene ? guide_text(card.step, card.is_mouse) : kElsewhere);
  ImGui::SetCursorPosY(place.w - place.y - ImGui::GetStyle().WindowPadding.y - ImGui::GetFrameHeight());
  const GuideAction action = draw_buttons(card);
  ImGui::End();
  return action;
}

}  // namespace tandem::client

#include "client/view/screen/style.hpp"

#include <cmath>
#include <filesystem>

namespace tandem::client {
namespace {

constexpr const char* kFont = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
constexpr float kFontPixels = 14;

}  // namespace

void apply_style(float scale) {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 6;
  style.FrameRounding = 3;
  style.WindowBorderSize = 0;
  style.Colors[ImGuiCol_WindowBg] = {0.09F, 0.11F, 0.13F, 0.86F};
  style.Colors[ImGuiCol_FrameBg] = {0.17F, 0.20F, 0.24F, 0.90F};
  style.Colors[ImGuiCol_Header] = {0.20F, 0.26F, 0.33F, 0.90F};
  style.ScaleAllSizes(scale);
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;
  // Delay until a held key repeats [s], as on most desktops. With the default of 0.25 s, a slow press of Ctrl+V pasted
  // an invitation twice, and servers refuse such a text.
  io.KeyRepeatDelay = 0.5F;
  if (std::filesystem::exists(kFont)) {
    io.Fonts->AddFontFromFileTTF(kFont, std::round(kFontPixels * scale));
  } else {
    io.FontGlobalScale = scale;
  }
}

void draw_explanation(const char* text) {
  ImGui::PushStyleColor(ImGuiCol_Text, kDim);
  ImGui::TextWrapped("%s", text);
  ImGui::PopStyleColor();
}

}  // namespace tandem::client

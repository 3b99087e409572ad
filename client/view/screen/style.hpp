// Sets colours, sizes and the font of panels and dialogs.
#pragma once

#include <imgui.h>

namespace tandem::client {

inline const ImVec4 kDim(0.72F, 0.76F, 0.80F, 1);
inline const ImVec4 kWarning(0.98F, 0.72F, 0.20F, 1);
inline const ImVec4 kTitle(0.95F, 0.97F, 1.0F, 1);

/// Sets style and font of the current ImGui context.
/// In      scale  number of physical pixels per logical pixel
void apply_style(float scale);
/// Draws an explanation as dim text, wrapped to the width of the window.
void draw_explanation(const char* text);

}  // namespace tandem::client

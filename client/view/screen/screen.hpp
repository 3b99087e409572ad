// The window of the operating system: GLFW, OpenGL and Dear ImGui, the pace of frames, and input since the last frame.
// The start screen and the session draw into the same one, so that it stays where the user has put it.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "client/view/renderer.hpp"

struct GLFWwindow;

namespace tandem::client {

struct ScreenSettings {
  std::string title = "tandem";
  int width = 1280;
  int height = 800;
  bool is_for_picture = false;  ///< every frame has the full quality, also without a graphics card
};

/// A frame is: begin_frame(), calls of Dear ImGui and OpenGL, end_frame().
///
/// Thread  main, the thread that constructed it
class Screen {
 public:
  /// Fails   std::runtime_error: there is no display or no OpenGL 3.3, or the program was built without a window; the
  ///         message names the remedy
  explicit Screen(const ScreenSettings& settings);
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  /// Waits until the next frame is due: at most 60 frames a second. Without a graphics card at most 30, with a pause
  /// after each frame that is as long as the frame took, up to 80 ms. Receives input and begins a frame of Dear ImGui.
  void begin_frame();
  /// Draws the frame of Dear ImGui, saves a requested picture, and shows the frame.
  void end_frame();
  /// Size of the frame's buffer [pixels].
  int width() const;
  int height() const;
  GLFWwindow* handle() const;
  /// Returns kFast if the driver renders on the processor, unless the window was opened for a picture.
  RenderQuality quality() const;
  void set_title(const std::string& title);

  /// Keys pressed since the last call, including keys pressed and released between two frames.
  std::vector<int> take_keys();
  /// Returns whether a double click was completed since the last call.
  bool pop_double_click();
  /// Files dropped onto the window since the last call.
  std::vector<std::filesystem::path> take_dropped();
  bool is_closed() const;
  /// Makes is_closed() true, as if the user had closed the window.
  void close();
  void toggle_full_screen();
  /// Writes the next frame also to a PNG file. If that fails, the frame's end throws std::runtime_error.
  /// In      is_scene_only  only the part that was drawn by OpenGL before end_frame(), without texts and panels
  void save_next_frame(const std::filesystem::path& file, bool is_scene_only);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client

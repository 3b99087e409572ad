// The window of the operating system, with GLFW, OpenGL and Dear ImGui. It limits the frame rate and collects the
// user's input between two frames. The start screen and the session use the same window, so its position and size do
// not change.
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
  bool is_for_picture = false;  ///< true: every frame has the full quality, even without a graphics card
};

/// A window. To draw a frame, call begin_frame(), then functions of Dear ImGui and OpenGL, then end_frame().
///
/// Thread  main thread, which must also construct it
class Screen {
 public:
  /// Fails   std::runtime_error if there is no display or no OpenGL 3.3, or if the program was built without a window;
  ///         the message names the remedy
  explicit Screen(const ScreenSettings& settings);
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  /// Waits until the next frame is due, receives input, and begins a frame of Dear ImGui. The frame rate is at most
  /// 60 Hz. Without a graphics card it is at most 30 Hz, and each frame is followed by a pause that is as long as the
  /// frame took, up to 80 ms.
  void begin_frame();
  /// Draws the panels of Dear ImGui, saves a requested picture, and displays the frame.
  void end_frame();
  /// Size of the frame buffer [pixels].
  int width() const;
  int height() const;
  GLFWwindow* handle() const;
  /// Returns kFast if the driver renders on the processor, unless the window was opened for a picture.
  RenderQuality quality() const;
  void set_title(const std::string& title);

  /// Returns the keys that were pressed since the last call, including keys that were already released.
  std::vector<int> take_keys();
  /// Returns whether a double click was completed since the last call.
  bool pop_double_click();
  /// Returns the files that were dropped onto the window since the last call.
  std::vector<std::filesystem::path> take_dropped();
  bool is_closed() const;
  /// Makes is_closed() true, as if the user had closed the window.
  void close();
  void toggle_full_screen();
  /// Requests that the next frame is also written to a PNG file. If writing fails, end_frame() throws
  /// std::runtime_error.
  /// In      is_scene_only  true: the file shows only what OpenGL has drawn before end_frame(), without texts and
  ///         panels
  void save_next_frame(const std::filesystem::path& file, bool is_scene_only);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client

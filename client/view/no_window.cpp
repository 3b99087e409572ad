// Replaces window.cpp in a build without the window (CMake option TANDEM_WINDOW=OFF).
#include <stdexcept>

#include "client/view/screen/screen.hpp"
#include "client/view/screen/start_screen.hpp"
#include "client/view/window.hpp"

namespace tandem::client {

struct Screen::Impl {};

Screen::Screen(const ScreenSettings&) {
  throw std::runtime_error("this program was built without its window (TANDEM_WINDOW=OFF); add --headless");
}
Screen::~Screen() = default;
void Screen::save_next_frame(const std::filesystem::path&, bool) {}
bool Screen::is_closed() const {
  return true;
}

class ScenePictures {};

StartScreen::StartScreen(Screen& screen, StartForm& form) : screen_(screen), form_(form) {}
StartScreen::~StartScreen() = default;
void StartScreen::draw(StartFlow&) {}

struct Window::Impl {};

Window::Window(WindowSettings) {}

Window::~Window() = default;
void Window::add(const TickRecord&) {}
void Window::draw(const View*, const ClientIoSnapshot&, const std::string&) {}
void Window::show_recording(bool, const std::string&) {}
void Window::show_news(const std::string&) {}
bool Window::pop_record_press() {
  return false;
}
WindowRequest Window::pop_request() {
  return WindowRequest::kNone;
}
bool Window::is_closed() const {
  return true;
}
bool Window::is_making() const {
  return false;
}
void Window::save_next_frame(const std::filesystem::path&) {}

}  // namespace tandem::client

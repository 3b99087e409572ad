// Acts as a file manager from which a user drags a file onto a window. It is the source in the protocol XDND, version 5
// (freedesktop.org, "Drag-and-Drop Protocol for the X Window System").
//
//   drop_file WINDOW FILE
//
// Exit code: 0 the window has taken the file, 1 it has refused it or did not answer, 2 wrong arguments.
#include <X11/Xatom.h>
#include <X11/Xlib.h>
#include <poll.h>

#include <cctype>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <utility>

namespace {

constexpr long kVersion = 5;
constexpr auto kPatience = std::chrono::seconds(180);

/// Returns the file's URI. All bytes except letters, digits and "/._-" are encoded.
std::string uri_of(const std::filesystem::path& file) {
  std::string uri = "file://";
  for (const char byte : std::filesystem::absolute(file).string()) {
    const bool is_plain =
        std::isalnum(static_cast<unsigned char>(byte)) != 0 || std::string("/._-").find(byte) != std::string::npos;
    char code[4];
    std::snprintf(code, sizeof code, "%%%02X", static_cast<unsigned>(static_cast<unsigned char>(byte)));
    uri += is_plain ? std::string(1, byte) : code;
  }
  return uri;
}

class Source {
 public:
  Source(Display* display, Window target, std::string uri)
      : display_(display),
        target_(target),
        uri_(std::move(uri)),
        own_(XCreateSimpleWindow(display, DefaultRootWindow(display), 0, 0, 1, 1, 0, 0, 0)) {}

  /// Returns whether the target has taken the file.
  bool drop() {
    XSetSelectionOwner(display_, atom("XdndSelection"), own_, CurrentTime);
    send("XdndEnter", {kVersion << 24, static_cast<long>(atom("text/uri-list")), 0, 0});
    send("XdndPosition", {0, place(), CurrentTime, static_cast<long>(atom("XdndActionCopy"))});
    if ((wait_for("XdndStatus").data.l[1] & 1) == 0) return false;
    send("XdndDrop", {0, CurrentTime, 0, 0});
    return (wait_for("XdndFinished").data.l[1] & 1) != 0;
  }

 private:
  Atom atom(const char* name) { return XInternAtom(display_, name, False); }

  /// Returns the position of the target's centre on the screen. The protocol packs it into one number: x in the upper
  /// 16 bits, y in the lower 16 bits.
  long place() {
    XWindowAttributes attributes{};
    XGetWindowAttributes(display_, target_, &attributes);
    return (static_cast<long>(attributes.x + attributes.width / 2) << 16) | (attributes.y + attributes.height / 2);
  }

  /// In      data  items of the message, after its first item, which is the window of the source
  void send(const char* type, std::initializer_list<long> data) {
    XEvent event{};
    event.xclient.type = ClientMessage;
    event.xclient.window = target_;
    event.xclient.message_type = atom(type);
    event.xclient.format = 32;
    event.xclient.data.l[0] = static_cast<long>(own_);
    int i = 1;
    for (const long each : data) event.xclient.data.l[i++] = each;
    XSendEvent(display_, target_, False, NoEventMask, &event);
    XFlush(display_);
  }

  /// Waits for a message of the target, and answers requests for the file meanwhile.
  XClientMessageEvent wait_for(const char* type) {
    const auto give_up = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < give_up) {
      pollfd connection{ConnectionNumber(display_), POLLIN, 0};
      if (XPending(display_) == 0 && poll(&connection, 1, 100) <= 0) continue;
      XEvent event{};
      while (XPending(display_) > 0) {
        XNextEvent(display_, &event);
        if (event.type == SelectionRequest) answer(event.xselectionrequest);
        if (event.type == ClientMessage && event.xclient.message_type == atom(type)) return event.xclient;
      }
    }
    throw std::runtime_error(std::string("the window has not sent ") + type + " within 180 s");
  }

  void answer(const XSelectionRequestEvent& request) {
    const std::string text = uri_ + "\r\n";
    XChangeProperty(display_, request.requestor, request.property, request.target, 8, PropModeReplace,
                    reinterpret_cast<const unsigned char*>(text.data()), static_cast<int>(text.size()));
    XEvent event{};
    event.xselection.type = SelectionNotify;
    event.xselection.requestor = request.requestor;
    event.xselection.selection = request.selection;
    event.xselection.target = request.target;
    event.xselection.property = request.property;
    event.xselection.time = request.time;
    XSendEvent(display_, request.requestor, False, NoEventMask, &event);
    XFlush(display_);
  }

  Display* display_;
  Window target_;
  std::string uri_;
  Window own_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "Usage: drop_file WINDOW FILE\n");
    return 2;
  }
  Display* const display = XOpenDisplay(nullptr);
  if (display == nullptr) {
    std::fprintf(stderr, "drop_file: no display\n");
    return 2;
  }
  try {
    return Source(display, std::strtoul(argv[1], nullptr, 0), uri_of(argv[2])).drop() ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "drop_file: %s\n", error.what());
    return 1;
  }
}

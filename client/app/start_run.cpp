// See start_run.hpp.
#include "client/app/start_run.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <optional>
#include <string>
#include <utility>

#include "client/app/client_run.hpp"
#include "client/app/run_settings.hpp"
#include "client/app/stop_signals.hpp"
#include "client/start/recent.hpp"
#include "client/start/start_flow.hpp"
#include "client/view/guide/guide.hpp"
#include "client/view/screen/screen.hpp"
#include "client/view/screen/start_screen.hpp"

namespace tandem::client {
namespace {

std::vector<std::string> device_lines(const std::string& of_hand) {
  std::vector<std::string> lines{"Your hand: " + of_hand + "."};
  for (const devices::DeviceKind& kind : devices::device_kinds()) {
    if (kind.find == nullptr || kind.name == of_hand) continue;
    for (const devices::FoundDevice& found : kind.find()) {
      const std::string name = std::string(kind.name) + " at " + found.where;
      lines.push_back("Found: " + name + (found.problem.empty() ? "." : ", " + found.problem));
    }
  }
  return lines;
}

StartForm new_form(const ClientOptions& options) {
  StartForm form;
  std::string name = options.io.client.session.user_name;
  // The default user name is the same for everybody, so the login name is preferred.
  if (const char* const user = std::getenv("USER"); name == SessionSettings{}.user_name && user != nullptr) name = user;
  name.copy(form.name.data(), form.name.size() - 1);
  form.devices = device_lines(options.device.name);
  form.about = "Not a certified safety system. Files of a mesh or a structure stay on the machine that opens them.";
  return form;
}

class StartRun {
 public:
  StartRun(const ClientOptions& options, realtime::Output& output, Screen& screen, RunEnd::Next next)
      : options_(options),
        output_(output),
        screen_(screen),
        flow_(program_beside("").parent_path(), recent_file()),
        form_(new_form(options)) {
    flow_.form().is_hosted = next == RunEnd::Next::kHost;
    form_.wants_guide = next == RunEnd::Next::kGuide;
  }

  int run() {
    while (choose()) {
      const int code = session();
      if (!returns_to_start_) return code;
    }
    return 0;
  }

 private:
  /// Draws the start screen until there is an address to join. Returns false if the program must end.
  bool choose();
  /// Runs one session. Sets returns_to_start_ if the start screen must be shown again afterwards.
  int session();
  void open_guide();
  bool is_pictured(LocalTime since);

  ClientOptions options_;
  realtime::Output& output_;
  Screen& screen_;
  StartFlow flow_;
  StartForm form_;
  bool returns_to_start_ = false;
};

bool StartRun::choose() {
  const StopSignals signals;
  StartScreen start(screen_, form_);
  const LocalTime since = SteadyClock().now();
  while (!screen_.is_closed() && !signals.is_requested()) {
    open_guide();
    start.draw(flow_);
    if (flow_.state() == StartFlow::State::kReady) return true;
    if (is_pictured(since)) {
      screen_.save_next_frame(options_.window.screenshot, false);
      start.draw(flow_);
      return false;
    }
  }
  return false;
}

/// Opens the scene of the guide if the user has requested it. With --await-server, waits until the server program
/// exists, because deploy/demo still compiles it while the start screen is shown. Without --await-server, a missing
/// program is an error, which the start screen shows.
void StartRun::open_guide() {
  if (flow_.state() != StartFlow::State::kChoosing) {
    form_.wants_guide = false;
    return;
  }
  form_.begins_guide = form_.wants_guide &&
                       (!options_.window.awaits_server || access(program_beside("tandem-server").c_str(), X_OK) == 0);
  if (!form_.begins_guide) return;
  form_.wants_guide = false;
  flow_.open({.kind = StartChoice::Kind::kScene, .scene = std::string(kGuideScene)});
}

/// Returns true if the screenshot of the start screen is due (--screenshot).
bool StartRun::is_pictured(LocalTime since) {
  return !options_.window.screenshot.empty() && SteadyClock().now() - since >= options_.window.after;
}

int StartRun::session() {
  returns_to_start_ = false;
  bool has_begun = false;
  int code = 1;
  try {
    ClientOptions options = options_to_join(options_, flow_.target(), form_.name.data(), flow_.has_server());
    options.window.begins_guide = form_.begins_guide;
    const RunEnd end = run_client(options, output_, screen_, flow_.invitations(), has_begun);
    returns_to_start_ = end.next != RunEnd::Next::kQuit;
    flow_.close("");
    flow_.form().is_hosted = end.next == RunEnd::Next::kHost;
    form_.wants_guide = end.next == RunEnd::Next::kGuide;
    code = end.code;
  } catch (const std::exception& error) {
    output_.err(std::string("tandem-client: ") + error.what() + "\n");
    flow_.close(error.what());
    returns_to_start_ = true;
  }
  if (has_begun) {
    options_ = options_of_next(std::move(options_));
    form_.address.fill('\0');  // the invitation in this field cannot be used again
  }
  return code;
}

}  // namespace

int run_from_start(const ClientOptions& options, realtime::Output& output) {
  check_screenshot(options.window.screenshot);
  Screen screen({.width = options.window.width,
                 .height = options.window.height,
                 .is_for_picture = !options.window.screenshot.empty()});
  return StartRun(options, output, screen, options.window.begins_guide ? RunEnd::Next::kGuide : RunEnd::Next::kOpen)
      .run();
}

int run_from_start(const ClientOptions& options, realtime::Output& output, Screen& screen, RunEnd::Next next) {
  return StartRun(options, output, screen, next).run();
}

}  // namespace tandem::client

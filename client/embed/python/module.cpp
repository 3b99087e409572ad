// The Python module tandem._tandem, a layer over tandem.hpp. Every call that may wait releases the interpreter's lock.
// No thread of the library ever takes this lock, so a busy interpreter does not delay the force.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/embed/cpp/tandem.hpp"

namespace {

namespace py = pybind11;
using WithoutLock = py::call_guard<py::gil_scoped_release>;

/// Ticks in memory. Python reads each field as a memoryview over all ticks, without a copy.
struct Ticks {
  std::shared_ptr<const std::vector<tandem_tick>> ticks;
};

/// One field of all ticks. A memoryview of it keeps the ticks alive.
struct Column {
  std::shared_ptr<const std::vector<tandem_tick>> ticks;
  std::size_t offset = 0;      ///< offset of the field within a tick [bytes]
  std::size_t item_bytes = 0;  ///< size of one number [bytes]
  std::string format;          ///< format of one number, as in Python's module struct
  std::size_t numbers = 1;     ///< numbers of this field in one tick, e.g. 3 for a vector
};

py::buffer_info buffer_of(const Column& column) {
  const auto* const first = reinterpret_cast<const char*>(column.ticks->data()) + column.offset;
  const auto count = static_cast<py::ssize_t>(column.ticks->size());
  std::vector<py::ssize_t> shape{count}, strides{sizeof(tandem_tick)};
  if (column.numbers > 1) {
    shape.push_back(static_cast<py::ssize_t>(column.numbers));
    strides.push_back(static_cast<py::ssize_t>(column.item_bytes));
  }
  return {const_cast<char*>(first),
          static_cast<py::ssize_t>(column.item_bytes),
          column.format,
          static_cast<py::ssize_t>(shape.size()),
          shape,
          strides,
          /*readonly=*/true};
}

template <class Number>
void add_column(py::class_<Ticks>& ticks, const char* name, std::size_t offset, std::size_t numbers = 1) {
  ticks.def_property_readonly(name, [offset, numbers](const Ticks& self) {
    return py::memoryview(
        py::cast(Column{self.ticks, offset, sizeof(Number), py::format_descriptor<Number>::format(), numbers}));
  });
}

template <std::size_t N>
std::array<double, N> copy_of(const double (&values)[N]) {
  std::array<double, N> copy{};
  for (std::size_t i = 0; i < N; ++i) copy[i] = values[i];
  return copy;
}

template <class Struct, std::size_t N>
void add_vector(py::class_<Struct>& to, const char* name, double (Struct::*values)[N]) {
  to.def_property_readonly(name, [values](const Struct& self) { return copy_of(self.*values); });
}

void copy_to(const std::array<double, 3>& from, double (&to)[3]) {
  for (std::size_t i = 0; i < 3; ++i) to[i] = from[i];
}

/// Longest time from Ctrl-C to the end of a wait.
constexpr tandem::Seconds kSlice{0.05};

/// Waits in slices, without the interpreter's lock. Between two slices, the signal handlers of Python run, so that
/// Ctrl-C ends the wait. Returns the status of the last slice.
/// In      timeout_s  the library refuses a time-out that is not valid
///         wait       waits for at most the given number of seconds, and returns a status
template <class Wait>
tandem_status wait_in_slices(double timeout_s, const Wait& wait) {
  const auto begin = std::chrono::steady_clock::now();
  double left_s = timeout_s;
  while (true) {
    const bool is_last = !(left_s > kSlice.count());  // also true for NaN, which the library refuses
    {
      const py::gil_scoped_release release;
      const tandem_status status = wait(is_last ? left_s : kSlice.count());
      if (is_last || status != TANDEM_TIMED_OUT) return tandem::detail::check(status);
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    left_s = std::max(0.0, timeout_s - tandem::Seconds(std::chrono::steady_clock::now() - begin).count());
  }
}

/// A client that Python can close before the object itself is released.
class Client {
 public:
  explicit Client(const tandem::ClientSettings& settings, std::shared_ptr<tandem::OwnDevice> device)
      : device_(std::move(device)), client_(std::in_place, settings) {}
  // Closing waits for the threads of the client. If this runs in Python's garbage collection, other threads of Python
  // continue, because the interpreter's lock is released.
  ~Client() {
    std::optional<py::gil_scoped_release> release;
    if (PyGILState_Check() != 0) release.emplace();
    client_.reset();
    device_.reset();
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Joins the room and starts the loop. After a failure, closes the client here, because Python does not call __exit__
  /// if __enter__ fails.
  void enter(double timeout_s) {
    try {
      without_lock([this] { client_->join(); });
      wait_joined(timeout_s);
      without_lock([this] { client_->start(); });
    } catch (...) {
      without_lock([this] { close(); });
      throw;
    }
  }
  void wait_joined(double timeout_s) {
    wait_in_slices(timeout_s, [this](double s) { return tandem_client_wait_joined(client_->handle(), s); });
  }
  /// Returns false after the time-out.
  bool wait_event(double timeout_s) {
    try {
      wait_in_slices(timeout_s, [this](double s) { return tandem_client_wait_event(client_->handle(), s); });
      return true;
    } catch (const tandem::Error& error) {
      if (error.status() != TANDEM_TIMED_OUT) throw;
      return false;
    }
  }
  // Closes the client. `client_` itself is kept, so that a later call fails with an error of the library (bad handle).
  void close() { tandem_client_close(client_->handle()); }
  tandem::Client& open() { return *client_; }

 private:
  template <class Function>
  static void without_lock(const Function& function) {
    const py::gil_scoped_release release;
    function();
  }

  std::shared_ptr<tandem::OwnDevice> device_;
  std::optional<tandem::Client> client_;
};

/// Iterator over events. It waits for the next event, and ends after `timeout_s` without an event.
struct Events {
  std::shared_ptr<Client> client;
  double timeout_s = 0;

  tandem::Event next() {
    while (true) {
      if (auto event = client->open().next_event()) return std::move(*event);
      if (!client->wait_event(timeout_s)) break;
    }
    throw py::stop_iteration();
  }
};

std::shared_ptr<Client> open_client(const std::string& server, const std::string& room, const std::string& user_name,
                                    const std::string& invitation, const std::string& pin,
                                    const std::string& authorities, const std::string& token, bool is_insecure,
                                    std::uint32_t role, bool uses_tcp, std::shared_ptr<tandem::OwnDevice> own_device,
                                    const std::string& device, const std::string& profile, const std::string& hand,
                                    const std::string& stage, const std::string& predictor, bool has_passivity,
                                    int realtime_priority, bool has_simulated_link, const std::string& firmware,
                                    double motor_counts_per_n_m, const std::string& library, const std::string& service,
                                    const std::string& motors) {
  tandem::ClientSettings settings;
  settings.server = server;
  settings.room = room;
  settings.user_name = user_name;
  settings.invitation = invitation;
  settings.pin = pin;
  settings.authorities = authorities;
  settings.token = token;
  settings.is_insecure = is_insecure;
  settings.role = role;
  settings.uses_tcp = uses_tcp;
  settings.own_device = own_device.get();
  settings.device = device;
  settings.profile = profile;
  settings.hand = hand;
  settings.stage = stage;
  settings.predictor = predictor;
  settings.has_passivity = has_passivity;
  settings.realtime_priority = realtime_priority;
  settings.has_simulated_link = has_simulated_link;
  settings.firmware = firmware;
  settings.motor_counts_per_n_m = motor_counts_per_n_m;
  settings.library = library;
  settings.service = service;
  settings.motors = motors;
  return std::make_shared<Client>(settings, std::move(own_device));
}

std::shared_ptr<tandem::OwnDevice> open_device(const std::string& name, bool senses_rotation, bool displays_torque,
                                               double force_limit_n, double force_maximum_n,
                                               const std::string& maximum_source) {
  tandem_device_settings settings{};
  settings.name = name.c_str();
  settings.abilities = (senses_rotation ? std::uint32_t{TANDEM_SENSES_ROTATION} : 0U) |
                       (displays_torque ? std::uint32_t{TANDEM_DISPLAYS_TORQUE} : 0U);
  settings.force_limit_n = force_limit_n;
  settings.force_maximum_n = force_maximum_n;
  settings.maximum_source = maximum_source.c_str();
  return std::make_shared<tandem::OwnDevice>(settings);
}

void feed(tandem::OwnDevice& device, const std::array<double, 3>& position_m, const std::array<double, 4>& rotation,
          std::uint32_t buttons, const std::optional<std::array<double, 3>>& velocity) {
  tandem_sample sample{};
  copy_to(position_m, sample.handle_D.position_m);
  for (std::size_t i = 0; i < 4; ++i) sample.handle_D.rotation_wxyz[i] = rotation[i];
  sample.buttons = buttons;
  sample.has_velocity = velocity ? 1 : 0;
  if (velocity) copy_to(*velocity, sample.velocity_D.linear_m_per_s);
  device.feed(sample);
}

void add_values(py::module_& m) {
  py::class_<tandem_pose> pose(m, "Pose");
  add_vector(pose, "position_m", &tandem_pose::position_m);
  add_vector(pose, "rotation_wxyz", &tandem_pose::rotation_wxyz);
  py::class_<tandem_wrench> wrench(m, "Wrench");
  add_vector(wrench, "force_n", &tandem_wrench::force_n);
  add_vector(wrench, "torque_n_m", &tandem_wrench::torque_n_m);
  py::class_<tandem_body>(m, "Body")
      .def_readonly("id", &tandem_body::id)
      .def_readonly("held_by", &tandem_body::held_by)
      .def_readonly("pose_W", &tandem_body::pose_W)
      .def_property_readonly("name", [](const tandem_body& self) { return std::string(self.name); });
  py::class_<tandem_user>(m, "User")
      .def_readonly("id", &tandem_user::id)
      .def_readonly("role", &tandem_user::role)
      .def_readonly("holds", &tandem_user::holds)
      .def_readonly("tool_W", &tandem_user::tool_W)
      .def_property_readonly("name", [](const tandem_user& self) { return std::string(self.name); });
  py::class_<tandem_session>(m, "Session")
      .def_readonly("state", &tandem_session::state)
      .def_readonly("user", &tandem_session::user)
      .def_readonly("role", &tandem_session::role)
      .def_readonly("reconnects", &tandem_session::reconnects)
      .def_readonly("lost_ticks", &tandem_session::lost_ticks)
      .def_readonly("lost_events", &tandem_session::lost_events)
      .def_property_readonly("device", [](const tandem_session& self) { return std::string(self.device); })
      .def_readonly("round_trip_s", &tandem_session::round_trip_s)
      .def_property_readonly("room", [](const tandem_session& self) { return std::string(self.room); })
      .def_property_readonly("law", [](const tandem_session& self) { return std::string(self.law); })
      .def_property_readonly("stage", [](const tandem_session& self) { return std::string(self.stage); })
      .def_property_readonly("reason", [](const tandem_session& self) { return std::string(self.reason); })
      .def_property_readonly("note", [](const tandem_session& self) { return std::string(self.note); });
  py::class_<tandem::Event>(m, "Event")
      .def_property_readonly("kind", [](const tandem::Event& self) { return self.about.kind; })
      .def_property_readonly("user", [](const tandem::Event& self) { return self.about.user; })
      .def_property_readonly("body", [](const tandem::Event& self) { return self.about.body; })
      .def_property_readonly("code", [](const tandem::Event& self) { return self.about.code; })
      .def_property_readonly("tag", [](const tandem::Event& self) { return self.about.tag; })
      .def_property_readonly("value", [](const tandem::Event& self) { return self.about.value; })
      .def_readonly("text", &tandem::Event::text);
  py::class_<tandem_force>(m, "Force")
      .def_property_readonly("is_stale", [](const tandem_force& self) { return self.is_stale != 0; })
      .def_readonly("on_hand_D", &tandem_force::on_hand_D)
      .def_readonly("commands", &tandem_force::commands);
}

void add_ticks(py::module_& m) {
  py::class_<Column>(m, "_Column", py::buffer_protocol()).def_buffer(&buffer_of);
  py::class_<Ticks> ticks(m, "Ticks");
  ticks.def("__len__", [](const Ticks& self) { return self.ticks->size(); });
  add_column<std::uint64_t>(ticks, "number", offsetof(tandem_tick, number));
  add_column<std::uint64_t>(ticks, "server_step", offsetof(tandem_tick, server_step));
  add_column<std::int64_t>(ticks, "time_ns", offsetof(tandem_tick, time_ns));
  add_column<std::uint32_t>(ticks, "safety", offsetof(tandem_tick, safety));
  add_column<double>(ticks, "state_age_s", offsetof(tandem_tick, state_age_s));
  add_column<std::uint32_t>(ticks, "held_body", offsetof(tandem_tick, held_body));
  add_column<double>(ticks, "device_position_m", offsetof(tandem_tick, device_D), 3);
  add_column<double>(ticks, "handle_position_m", offsetof(tandem_tick, handle_W), 3);
  add_column<double>(ticks, "handle_velocity_m_per_s", offsetof(tandem_tick, handle_velocity_W), 3);
  add_column<double>(ticks, "tool_position_m", offsetof(tandem_tick, tool_W), 3);
  add_column<double>(ticks, "force_n", offsetof(tandem_tick, on_hand_D), 3);

  py::class_<tandem::Snapshot>(m, "Snapshot")
      .def_readonly("has_tick", &tandem::Snapshot::has_tick)
      .def_property_readonly("has_state", [](const tandem::Snapshot& self) { return self.room.has_state != 0; })
      .def_property_readonly("step", [](const tandem::Snapshot& self) { return self.room.step; })
      .def_property_readonly("server_faults", [](const tandem::Snapshot& self) { return self.room.server_faults; })
      .def_property_readonly("number", [](const tandem::Snapshot& self) { return self.tick.number; })
      .def_property_readonly("time_ns", [](const tandem::Snapshot& self) { return self.tick.time_ns; })
      .def_property_readonly("state_age_s", [](const tandem::Snapshot& self) { return self.tick.state_age_s; })
      .def_property_readonly("safety", [](const tandem::Snapshot& self) { return self.tick.safety; })
      .def_property_readonly("held_body", [](const tandem::Snapshot& self) { return self.tick.held_body; })
      .def_property_readonly("handle_W", [](const tandem::Snapshot& self) { return self.tick.handle_W; })
      .def_property_readonly("tool_W", [](const tandem::Snapshot& self) { return self.tick.tool_W; })
      .def_property_readonly("on_hand_D", [](const tandem::Snapshot& self) { return self.tick.on_hand_D; });
}

void add_commands(py::class_<Client, std::shared_ptr<Client>>& client) {
  const auto add = [&client](const char* name, auto function, auto... arguments) {
    client.def(name, function, WithoutLock(), arguments...);
  };
  add(
      "grab", [](Client& self, std::uint32_t body) { self.open().grab(body); }, py::arg("body") = 0);
  add("release", [](Client& self) { self.open().release(); });
  add(
      "point",
      [](Client& self, const std::array<double, 3>& place, std::uint32_t body) {
        double to[3];
        copy_to(place, to);
        self.open().point(to, body);
      },
      py::arg("place_W_m"), py::arg("body") = 0);
  add(
      "set_parameter",
      [](Client& self, const std::string& name, double value) { self.open().set_parameter(name, value); },
      py::arg("name"), py::arg("value"));
  add(
      "set_law", [](Client& self, const std::string& law) { self.open().set_law(law); }, py::arg("law"));
  add(
      "set_stage",
      [](Client& self, const std::string& stage, const std::string& predictor, bool has_passivity) {
        self.open().set_stage(stage, predictor, has_passivity);
      },
      py::arg("stage"), py::arg("predictor") = "", py::arg("has_passivity") = true);
  add(
      "set_link",
      [](Client& self, double delay_s, double jitter_s, double loss) {
        self.open().set_link(tandem::Seconds(delay_s), tandem::Seconds(jitter_s), loss);
      },
      py::arg("delay_s"), py::arg("jitter_s") = 0.0, py::arg("loss") = 0.0);
  add("reset_room", [](Client& self) { self.open().reset_room(); });
  add(
      "change_room", [](Client& self, const std::string& room) { self.open().change_room(room); }, py::arg("room"));
  add(
      "set_nudges", [](Client& self, bool has_nudges) { self.open().set_nudges(has_nudges); }, py::arg("has_nudges"));
  add(
      "set_workspace", [](Client& self, double scale, double turn_rad) { self.open().set_workspace(scale, turn_rad); },
      py::arg("scale"), py::arg("turn_rad") = 0.0);
  add(
      "request_pose",
      [](Client& self, std::uint32_t request, std::uint32_t number, const std::string& name, std::uint32_t tag) {
        self.open().request_pose(request, number, name, tag);
      },
      py::arg("request"), py::arg("number") = 0, py::arg("name") = "", py::arg("tag") = 0);
}

void add_client(py::module_& m) {
  py::class_<tandem::OwnDevice, std::shared_ptr<tandem::OwnDevice>>(m, "OwnDevice")
      .def(py::init(&open_device), py::arg("name") = "python", py::arg("senses_rotation") = false,
           py::arg("displays_torque") = false, py::arg("force_limit_n") = 0.0, py::arg("force_maximum_n") = 0.0,
           py::arg("maximum_source") = "")
      .def("feed", &feed, py::arg("position_m"), py::arg("rotation_wxyz") = std::array<double, 4>{1, 0, 0, 0},
           py::arg("buttons") = 0, py::arg("velocity_m_per_s") = py::none())
      .def("force", &tandem::OwnDevice::force);

  py::class_<Events>(m, "_Events").def("__iter__", [](py::object self) { return self; }).def("__next__", &Events::next);

  py::class_<Client, std::shared_ptr<Client>> client(m, "Client");
  client
      .def(py::init(&open_client), WithoutLock(), py::kw_only(), py::arg("server") = "", py::arg("room") = "",
           py::arg("user_name") = "", py::arg("invitation") = "", py::arg("pin") = "", py::arg("authorities") = "",
           py::arg("token") = "", py::arg("is_insecure") = false, py::arg("role") = 0, py::arg("uses_tcp") = false,
           py::arg("own_device") = std::shared_ptr<tandem::OwnDevice>(), py::arg("device") = "",
           py::arg("profile") = "", py::arg("hand") = "", py::arg("stage") = "", py::arg("predictor") = "",
           py::arg("has_passivity") = true, py::arg("realtime_priority") = 0, py::arg("has_simulated_link") = false,
           py::arg("firmware") = "", py::arg("motor_counts_per_n_m") = 0.0, py::arg("library") = "",
           py::arg("service") = "", py::arg("motors") = "")
      .def(
          "join", [](Client& self) { self.open().join(); }, WithoutLock())
      .def("wait_joined", &Client::wait_joined, py::arg("timeout_s") = 20.0)
      .def("wait_event", &Client::wait_event, py::arg("timeout_s"))
      .def(
          "start", [](Client& self) { self.open().start(); }, WithoutLock())
      .def(
          "stop", [](Client& self) { self.open().stop(); }, WithoutLock())
      .def("close", &Client::close, WithoutLock())
      .def("__enter__",
           [](const std::shared_ptr<Client>& self) {
             self->enter(20);
             return self;
           })
      .def("__exit__",
           [](Client& self, const py::object&, const py::object&, const py::object&) {
             const py::gil_scoped_release release;
             self.close();
           })
      .def(
          "session", [](Client& self) { return self.open().session(); }, WithoutLock())
      .def(
          "snapshot", [](Client& self) { return self.open().snapshot(); }, WithoutLock())
      .def(
          "bodies", [](Client& self) { return self.open().bodies(); }, WithoutLock())
      .def(
          "users", [](Client& self) { return self.open().users(); }, WithoutLock())
      .def(
          "read_ticks",
          [](Client& self, std::uint32_t most) {
            return Ticks{std::make_shared<const std::vector<tandem_tick>>(self.open().read_ticks(most))};
          },
          WithoutLock(), py::arg("most") = 4096)
      .def(
          "events",
          [](const std::shared_ptr<Client>& self, double timeout_s) {
            return Events{self, timeout_s};
          },
          py::arg("timeout_s") = 0.0);
  add_commands(client);
}

void add_constants(py::module_& m) {
  const std::vector<std::pair<const char*, int>> constants{
      {"MANIPULATOR", TANDEM_MANIPULATOR},
      {"OBSERVER", TANDEM_OBSERVER},
      {"OPERATOR", TANDEM_OPERATOR},
      {"JOINED", TANDEM_JOINED},
      {"SESSION_ENDED", TANDEM_SESSION_ENDED},
      {"BUTTON_GRAB", TANDEM_BUTTON_GRAB},
      {"BUTTON_CLUTCH", TANDEM_BUTTON_CLUTCH},
      {"EVENT_STATE", TANDEM_EVENT_STATE},
      {"EVENT_JOINED", TANDEM_EVENT_JOINED},
      {"EVENT_USER_JOINED", TANDEM_EVENT_USER_JOINED},
      {"EVENT_USER_LEFT", TANDEM_EVENT_USER_LEFT},
      {"EVENT_GRABBED", TANDEM_EVENT_GRABBED},
      {"EVENT_RELEASED", TANDEM_EVENT_RELEASED},
      {"EVENT_PARAMETER_SET", TANDEM_EVENT_PARAMETER_SET},
      {"EVENT_LAW_SET", TANDEM_EVENT_LAW_SET},
      {"EVENT_REFUSED", TANDEM_EVENT_REFUSED},
      {"EVENT_POSE_ANSWERED", TANDEM_EVENT_POSE_ANSWERED},
      {"EVENT_NEWS", TANDEM_EVENT_NEWS},
      {"EVENT_LOG", TANDEM_EVENT_LOG},
      {"BAD_HANDLE", TANDEM_BAD_HANDLE},
      {"BAD_ARGUMENT", TANDEM_BAD_ARGUMENT},
      {"BAD_STATE", TANDEM_BAD_STATE},
      {"SETUP_FAILED", TANDEM_SETUP_FAILED},
      {"ENDED", TANDEM_ENDED},
      {"TIMED_OUT", TANDEM_TIMED_OUT},
  };
  for (const auto& [name, value] : constants) m.attr(name) = value;
}

}  // namespace

PYBIND11_MODULE(_tandem, m) {
  m.attr("__version__") = tandem_version();
  m.attr("protocol_version") = tandem_protocol_version();
  static py::exception<tandem::Error> error(m, "Error", PyExc_RuntimeError);
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const tandem::Error& found) {
      const py::object made = static_cast<const py::object&>(error)(found.what());
      made.attr("status") = found.status();
      PyErr_SetObject(error.ptr(), made.ptr());
    }
  });
  add_constants(m);
  add_values(m);
  add_ticks(m);
  add_client(m);
}

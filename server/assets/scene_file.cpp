#include "server/assets/scene_file.hpp"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "common/contact/round/too_thin.hpp"
#include "proto/control_framing.hpp"
#include "proto/placement.hpp"
#include "proto/world_from_wire.hpp"
#include "server/assets/mass_properties.hpp"
#include "server/assets/molecular_scale.hpp"
#include "server/assets/scene_checks.hpp"
#include "server/assets/scene_coupling.hpp"
#include "server/assets/scene_effects.hpp"
#include "server/assets/scene_goals.hpp"
#include "server/assets/soft_scene.hpp"

namespace tandem::server {
namespace {

constexpr std::size_t kMaxSceneFileBytes = 1U << 20U;

/// Returns the number of the line with a syntax error; 0 if it is unknown. protobuf's message quotes the source text at
/// the error, and that text is searched for in the file.
std::size_t line_of_error(const std::string& json, const std::string& message) {
  const std::size_t quote_begin = message.find('\n');
  const std::size_t quote_end = message.rfind('\n');
  if (quote_begin == std::string::npos || quote_end <= quote_begin) return 0;
  const std::string quote = message.substr(quote_begin + 1, quote_end - quote_begin - 1);
  // For an error at the end of the text, the quote is empty.
  std::size_t position = json.size();
  if (!quote.empty()) {
    position = json.find(quote);
    if (position == std::string::npos) return 0;
    position = std::min(json.size(), position + (message.size() - quote_end - 2));
  }
  return 1 +
         static_cast<std::size_t>(std::count(json.begin(), json.begin() + static_cast<std::ptrdiff_t>(position), '\n'));
}

/// Converts "(bodies[0]) nam: Cannot find field." to "bodies[0].nam". Returns an empty string for any other message.
std::string unknown_field(const std::string& message) {
  const std::size_t suffix = message.find(": Cannot find field.");
  if (suffix == std::string::npos) return {};
  std::string field = message.substr(0, suffix);
  const std::size_t close = field.find(") ");
  if (field.front() != '(' || close == std::string::npos) return field;
  return (close > 1 ? field.substr(1, close - 1) + "." : "") + field.substr(close + 2);
}

wire::Scene parse(const std::string& json, const SceneField& file) {
  if (json.size() > kMaxSceneFileBytes) file.refuse("is larger than 1 MiB; a scene file holds no geometry");
  wire::Scene scene;
  const auto status = google::protobuf::util::JsonStringToMessage(json, &scene);
  if (status.ok()) return scene;
  const std::string message(status.message());
  if (const std::string field = unknown_field(message); !field.empty()) {
    if (const std::string text = unknown_effect_field_remedy(field); !text.empty()) file.in(field).refuse(text);
    if (const std::string text = unknown_goal_field_remedy(field); !text.empty()) file.in(field).refuse(text);
    file.in(field).refuse("is not a field of a scene; see proto/tandem/scene.proto for those that are");
  }
  const std::size_t line = line_of_error(json, message);
  const std::string where = line > 0 ? "line " + std::to_string(line) + ": " : "";
  file.refuse(where + "not a scene in JSON: " + message.substr(0, message.find('\n')));
}

/// Returns the mass properties of a body with these shapes. Refuses shapes without volume.
/// In      remedy  advice in the message of the refusal
MassProperties checked_mass(double mass_kg, const std::vector<SolidShape>& shapes, const SceneField& field,
                            const std::string& remedy) {
  try {
    return mass_properties_of(mass_kg, shapes);
  } catch (const std::domain_error& error) {
    field.in("mass_kg").refuse("is " + number_text(mass_kg) + ", but " + error.what() +
                               ": a sheet has none of its own, only that of its convex hull; " + remedy);
  }
}

/// Converts a checked description into a loaded scene, part by part.
class SceneBuilder {
 public:
  SceneBuilder(wire::Scene description, SceneField file, const std::filesystem::path& directory,
               const SceneLoading& loading)
      : file_(std::move(file)),
        progress_(loading.progress),
        assets_(directory, loading),
        scene_(std::make_shared<LoadedScene>()) {
    scene_->description = std::move(description);
  }

  std::shared_ptr<const LoadedScene> build() {
    wire::Scene& description = scene_->description;
    scene_->world = proto::world_from_wire(description);
    scene_->molecule_centres_angstrom.resize(scene_->world.bodies.size(), Vec3::Zero());
    // All files are read before the first contact shape is built. An error in a file, such as a wrong scale, is thus
    // reported before the build, which takes long.
    assets_.add_sources(description);
    for (int i = 0; i < description.bodies_size(); ++i) add_body(i);
    for (int i = 0; i < description.tools_size(); ++i) add_tool(i);
    for (int i = 0; i < description.soft_bodies_size(); ++i) {
      add_soft_body(*description.mutable_soft_bodies(i), file_.in("soft_bodies", static_cast<std::size_t>(i)));
    }
    for (int i = 0; i < description.bodies_size(); ++i) build_body(i);
    for (int i = 0; i < description.tools_size(); ++i) build_tool(i);
    check_atom_pairs();
    scale_molecules();
    scene_->world.coupling.fit = adaptive_fit(description.coupling());
    if (description.has_molecular_field()) hide_directory(*description.mutable_molecular_field());
    scene_->assets = std::move(assets_.assets);
    scene_->notes = std::move(assets_.notes);
    scene_->notes_for_users = std::move(assets_.notes_for_users);
    check_size();
    return scene_;
  }

 private:
  using Shapes = google::protobuf::RepeatedPtrField<wire::Shape>;

  /// Loads the files of shapes without building contact shapes, so that errors are reported before the long build.
  std::vector<SolidShape> load_shapes(Shapes& shapes, const SceneField& field) {
    std::vector<SolidShape> solids;
    for (int i = 0; i < shapes.size(); ++i) {
      SolidShape solid;
      if (shapes[i].has_mesh()) {
        solid.touched = std::make_shared<const geometry::ContactMesh>(
            assets_.load_mesh(*shapes[i].mutable_mesh(), mesh_field(field, i)));
        solid.mesh = {solid.touched, &solid.touched->mesh};
        solid.mesh_kind = solid.touched->kind;
      }
      solid.shape = shapes[i];
      solids.push_back(std::move(solid));
    }
    return solids;
  }

  physics::TouchModel make_contacts(Shapes& shapes, const SceneField& field, const std::vector<SolidShape>& solids,
                                    double stiffness_n_per_m3) {
    std::vector<physics::TouchModel::Part> parts;
    for (int i = 0; i < shapes.size(); ++i) {
      const SolidShape& solid = solids[static_cast<std::size_t>(i)];
      auto contact = shapes[i].has_mesh()
                         ? mesh_contact(*shapes[i].mutable_mesh(), solid, mesh_field(field, i).in("file"))
                         : proto::primitive_contact(shapes[i]);
      if (contact) note_thinness(*contact, shapes[i], shape_field(field, i));
      parts.push_back({std::move(contact), proto::pose_from_placement(shapes[i].placement())});
    }
    return proto::touch_model_of(std::move(parts), stiffness_n_per_m3);
  }

  std::shared_ptr<const contact::ContactShape> mesh_contact(wire::Mesh& message, const SolidShape& shape,
                                                            const SceneField& file_field) {
    const auto refuse = [&](const std::exception& error) {
      file_field.refuse("is " + message.file() + ", which cannot be touched: " + error.what());
    };
    try {
      auto contact = assets_.mesh_contact(*shape.touched, message);
      assets_.add_surface(geometry::all_of(*shape.touched), message);
      return contact;
    } catch (const geometry::MeshError& error) {
      refuse(error);
    } catch (const std::invalid_argument& error) {
      refuse(error);
    }
    return nullptr;
  }

  void note_thinness(const contact::ContactShape& shape, const wire::Shape& message, const SceneField& field) {
    const std::string why = contact::why_too_thin(shape);
    if (why.empty()) return;
    assets_.add_user_note(field.name() + (message.has_mesh() ? " (" + message.mesh().file() + ") " : " ") + why);
  }

  static SceneField shape_field(const SceneField& field, int shape) {
    return field.in("shapes", static_cast<std::size_t>(shape));
  }
  static SceneField mesh_field(const SceneField& field, int shape) { return shape_field(field, shape).in("mesh"); }

  void add_body(int index) {
    wire::Body& message = *scene_->description.mutable_bodies(index);
    const SceneField field = file_.in("bodies", static_cast<std::size_t>(index));
    physics::BodyDescription& body = scene_->world.bodies[static_cast<std::size_t>(index)];
    if (message.shapes(0).has_molecule()) {
      const wire::MolecularField& molecular = scene_->description.molecular_field();
      body.molecule = assets_.load_centred_molecule(
          *message.mutable_shapes(0)->mutable_molecule(), molecular.force_field_directory(),
          field.in("shapes", 0).in("molecule"), scene_->molecule_centres_angstrom[static_cast<std::size_t>(index)]);
      body.mass = mass_properties_of(message.mass_kg(), *body.molecule, molecular.metres_per_angstrom());
      scene_->body_shapes.push_back({SolidShape{message.shapes(0), nullptr, {}}});
      return;
    }
    std::vector<SolidShape> solids = load_shapes(*message.mutable_shapes(), field);
    body.mass = checked_mass(message.mass_kg(), solids, field, "make it static (0), or give the mesh thickness");
    scene_->body_shapes.push_back(std::move(solids));
  }

  void build_body(int index) {
    wire::Body& message = *scene_->description.mutable_bodies(index);
    if (message.shapes(0).has_molecule()) return;
    const auto place = static_cast<std::size_t>(index);
    scene_->world.bodies[place].touch = make_contacts(*message.mutable_shapes(), file_.in("bodies", place),
                                                      scene_->body_shapes[place], message.contact_stiffness_n_per_m3());
  }

  void add_tool(int index) {
    wire::Tool& message = *scene_->description.mutable_tools(index);
    const SceneField field = file_.in("tools", static_cast<std::size_t>(index));
    physics::ToolDescription& tool = scene_->world.tools[static_cast<std::size_t>(index)];
    std::vector<SolidShape> solids = load_shapes(*message.mutable_shapes(), field);
    tool.mass = checked_mass(message.mass_kg(), solids, field, "give the mesh thickness");
    const double least = message.mass_kg() * kToolGyrationRadius_m * kToolGyrationRadius_m;
    tool.mass.principal_inertia_kg_m2 = tool.mass.principal_inertia_kg_m2.cwiseMax(least);
    tool_shapes_.push_back(std::move(solids));
    const wire::Workspace& workspace = message.workspace();
    scene_->workspaces.push_back(
        {proto::pose_from_placement(workspace.device_base()), workspace.position_scale(), workspace.force_scale()});
  }

  void build_tool(int index) {
    wire::Tool& message = *scene_->description.mutable_tools(index);
    const auto place = static_cast<std::size_t>(index);
    scene_->world.tools[place].touch = make_contacts(*message.mutable_shapes(), file_.in("tools", place),
                                                     tool_shapes_[place], message.contact_stiffness_n_per_m3());
  }

  void add_soft_body(wire::SoftBody& body, const SceneField& field) {
    std::optional<geometry::ContactMesh> mesh;
    if (body.has_mesh()) mesh = assets_.load_mesh(*body.mutable_mesh(), field.in("mesh"));
    if (mesh) assets_.add_surface(mesh->mesh, *body.mutable_mesh());
    scene_->soft_bodies.push_back(soft_model_of(body, mesh ? &*mesh : nullptr, field));
    assets_.notes.push_back(soft_note(scene_->soft_bodies.back(), scene_->description));
  }

  /// Fills in those numbers of the molecular field that the scene file does not specify.
  void scale_molecules() {
    if (!scene_->description.has_molecular_field()) return;
    std::vector<const docking::Molecule*> molecules;
    std::vector<Vec3> centres_angstrom;
    for (std::size_t i = 0; i < scene_->world.bodies.size(); ++i) {
      if (scene_->world.bodies[i].molecule == nullptr) continue;
      molecules.push_back(scene_->world.bodies[i].molecule.get());
      centres_angstrom.push_back(scene_->molecule_centres_angstrom[i]);
    }
    wire::MolecularField& field = *scene_->description.mutable_molecular_field();
    try {
      for (const std::string& note :
           complete_molecular_scale(field, molecules, centres_angstrom, scene_->world.field_model, progress_)) {
        assets_.add_user_note(note);
      }
    } catch (const std::invalid_argument& error) {
      file_.in("molecular_field").refuse(error.what());
    }
    scene_->world.molecular_zero_kt = field.zero_area_kt();
    scene_->world.newtons_per_kcal_per_mol_angstrom = field.newtons_per_kcal_per_mol_angstrom();
    scene_->world.molecular_knee_kcal_per_mol = field.knee_kcal_per_mol();
    scene_->world.molecular_minimum_kcal_per_mol = field.minimum_kcal_per_mol();
  }

  /// Refuses a scene whose steps would exceed the step period. The operator then gets an error at loading time, and no
  /// user experiences a slow simulation.
  void check_atom_pairs() const {
    // With a cut-off, the work depends on the size of the contact area, which is unknown here.
    if (scene_->world.field_model.cutoff_angstrom > 0) return;
    double pairs = 0, atoms = 0;
    for (const physics::BodyDescription& body : scene_->world.bodies) {
      if (body.molecule == nullptr) continue;
      pairs += atoms * static_cast<double>(body.molecule->size());
      atoms += static_cast<double>(body.molecule->size());
    }
    const double most = scene_->world.limits.atom_pairs;
    if (pairs <= most) return;
    file_.in("limits")
        .in("atom_pairs")
        .refuse("is " + number_text(most) + ", and the molecules have " + number_text(pairs) +
                " pairs, all of them evaluated in each step; give molecular_field.cutoff_angstrom (8 is usual), choose "
                "chains that touch (molecule.chains), or raise it where server and clients can bear that");
  }

  /// Removes the path of the force field's folder, so that clients do not see folders of the server.
  static void hide_directory(wire::MolecularField& field) {
    field.set_force_field_directory(std::filesystem::path(field.force_field_directory()).filename().string());
  }

  void check_size() const {
    // Half of the limit is left for the other fields of the message Joined, which take a few kilobytes.
    const std::size_t size = scene_->description.ByteSizeLong();
    if (size > proto::kMaxControlBytes / 2) {
      file_.refuse("has a description of " + std::to_string(size) + " bytes; at most " +
                   std::to_string(proto::kMaxControlBytes / 2) + " can be sent to clients: use fewer shapes");
    }
  }

  SceneField file_;
  std::function<void(const std::string& what, double done)> progress_;
  SceneAssets assets_;
  std::vector<std::vector<SolidShape>> tool_shapes_;  ///< stored until their contact shapes are built
  std::shared_ptr<LoadedScene> scene_;
};

}  // namespace

std::vector<BodyId> moving_bodies_of(const LoadedScene& scene) {
  std::vector<BodyId> moving;
  for (std::size_t i = 0; i < scene.world.bodies.size(); ++i) {
    if (scene.world.bodies[i].mass.mass_kg > 0) moving.push_back(body_id_at(i));
  }
  return moving;
}

docking::Molecule molecule_in_its_file(const LoadedScene& scene, std::size_t body) {
  docking::Molecule molecule = *scene.world.bodies[body].molecule;
  for (Vec3& position : molecule.positions_angstrom) position += scene.molecule_centres_angstrom[body];
  return molecule;
}

physics::MovedMass moved_mass(const LoadedScene& scene, std::size_t tool, std::optional<std::size_t> held) noexcept {
  return physics::moved_mass(held ? scene.world.bodies[*held].mass : scene.world.tools[tool].mass, held.has_value());
}

std::shared_ptr<const LoadedScene> load_scene_text(const std::string& json, const std::string& origin,
                                                   const std::filesystem::path& directory,
                                                   const SceneLoading& loading) {
  const SceneField file(origin);
  wire::Scene description = parse(json, file);
  complete_and_check(description, file);
  return SceneBuilder(std::move(description), file, directory, loading).build();
}

std::shared_ptr<const LoadedScene> load_scene(const std::filesystem::path& file, const SceneLoading& loading) {
  std::ifstream stream(file);
  if (!stream || std::filesystem::is_directory(file)) {
    throw SceneError(file.string() + ": cannot be read; give the path of a scene file (server/scenes holds examples)");
  }
  // One byte above the limit is requested, so that a file that is too large is detected without reading all of it.
  std::string text(kMaxSceneFileBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  return load_scene_text(text, file.string(), file.parent_path(), loading);
}

}  // namespace tandem::server

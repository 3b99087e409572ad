#include "client/start/start_choice.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/json.hpp>
#include <fstream>
#include <set>
#include <stdexcept>

#include "client/start/shipped_scenes.hpp"
#include "tests/client/start/some_invitation.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::client {
namespace {

namespace fs = std::filesystem;
using Kind = StartChoice::Kind;

class StartChoiceTest : public testing::Test {
 protected:
  fs::path folder_ = fs::path(testing::TempDir()) / "start_choice";

  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  std::string file(const std::string& name) const {
    std::ofstream(folder_ / name) << "x";
    return (folder_ / name).string();
  }
};

std::string invitation() {
  return test::some_invitation("192.0.2.2:47800");
}

std::string why_not_joined(const std::string& pasted) {
  try {
    join_target(pasted);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

bool has(const std::vector<std::string>& arguments, const std::vector<std::string>& some) {
  return !std::ranges::search(arguments, some).empty();
}

TEST(ShippedScenes, AreTheSceneFilesThatHaveADescription) {
  std::set<std::string> described, listed;
  for (const auto& entry : fs::directory_iterator(tandem::test::source_path("server/scenes"))) {
    if (entry.path().extension() != ".json") continue;  // skips meshes of scenes
    std::ifstream in(entry.path());
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    if (boost::json::parse(text).as_object().contains("description")) described.insert(entry.path().stem().string());
  }
  for (const ShippedScene& scene : shipped_scenes()) {
    listed.insert(std::string(scene.name));
    EXPECT_LE(scene.title.size(), 24U) << scene.name;
    EXPECT_LE(scene.sentence.size(), 90U) << scene.name;
    EXPECT_EQ(scene.sentence.back(), '.') << scene.name;
  }
  EXPECT_EQ(listed, described);
}

TEST(ShippedScenes, HaveAPictureAndThePartnersTheirPath) {
  for (const ShippedScene& scene : shipped_scenes()) {
    EXPECT_TRUE(
        fs::exists(tandem::test::source_path("client/view/pictures/scenes") / (std::string(scene.name) + ".png")))
        << scene.name;
    if (!scene.partner.empty()) {
      EXPECT_TRUE(fs::exists(tandem::test::source_path("lab") / scene.partner)) << scene.name;
    }
  }
}

TEST_F(StartChoiceTest, ADroppedFileIsOpenedByItsEnding) {
  EXPECT_EQ(with_file({}, "a/part.STL")->mesh, "a/part.STL");
  EXPECT_EQ(with_file({}, "a/part.glb")->kind, Kind::kMesh);
  EXPECT_EQ(with_file({}, "a/scene.json")->kind, Kind::kScene);
  const auto first = with_file({}, "a.pdb.gz");
  EXPECT_EQ(first->kind, Kind::kDock);
  EXPECT_EQ(first->receptor, "a.pdb.gz");
  const auto second = with_file(*first, "b.cif");
  EXPECT_EQ(second->receptor, "a.pdb.gz");
  EXPECT_EQ(second->ligand, "b.cif");
  const auto third = with_file(*second, "c.pqr");
  EXPECT_EQ(third->receptor, "c.pqr") << "a third file begins another pair";
  EXPECT_EQ(third->ligand, "");
  EXPECT_FALSE(with_file({}, "letter.doc"));
}

TEST_F(StartChoiceTest, AFileThatCannotBeOpenedIsExplained) {
  EXPECT_EQ(problem_of({.kind = Kind::kMesh, .mesh = " '" + file("part.stl") + "'\n"}), "") << "pasted with quotes";
  EXPECT_EQ(problem_of({.kind = Kind::kMesh, .mesh = "file://" + file("part.stl")}), "") << "from a file manager";
  EXPECT_NE(problem_of({.kind = Kind::kMesh}).find("drop the file"), std::string::npos);
  EXPECT_NE(problem_of({.kind = Kind::kMesh, .mesh = "/none/part.stl"}).find("/none/part.stl cannot be read"),
            std::string::npos);
  EXPECT_NE(problem_of({.kind = Kind::kMesh, .mesh = file("part.doc")}).find("no mesh file; give .stl"),
            std::string::npos);
  EXPECT_NE(problem_of({.kind = Kind::kMesh, .mesh = folder_.string()}).find("is a folder"), std::string::npos);
  const std::string pdb = file("a.pdb");
  EXPECT_EQ(problem_of({.kind = Kind::kDock, .receptor = pdb + ":A", .ligand = pdb + ":B"}), "");
  EXPECT_NE(problem_of({.kind = Kind::kDock, .receptor = pdb}).find("the second structure file"), std::string::npos);
  EXPECT_EQ(problem_of({.scene = "crate"}), "");
  EXPECT_NE(problem_of({.scene = "no_such_scene"}).find("cannot be read"), std::string::npos);
}

TEST_F(StartChoiceTest, TheUriOfAFileIsDecoded) {
  const std::string name = file("a part 100%.stl");
  std::string uri = "file://" + name.substr(0, name.size() - std::string("a part 100%.stl").size());
  EXPECT_EQ(problem_of({.kind = Kind::kMesh, .mesh = uri + "a%20part%20100%25.st%6C"}), "");
  uri.insert(std::string("file://").size(), "localhost");
  EXPECT_EQ(problem_of({.kind = Kind::kMesh, .mesh = uri + "a part%20100%25.st%6c\r\n"}), "") << "with a host";
  EXPECT_EQ(title_of({.kind = Kind::kMesh, .mesh = "file:///a/b%4"}), "b%4") << "a cut code";
  EXPECT_EQ(title_of({.kind = Kind::kMesh, .mesh = "file:///a/b%"}), "b%");
  EXPECT_EQ(title_of({.kind = Kind::kMesh, .mesh = "file:///a/%00%zz"}), "%00%zz") << "no codes of a path";
  EXPECT_EQ(title_of({.kind = Kind::kMesh, .mesh = "/a/b%20c.stl"}), "b%20c.stl") << "a path is no URI";
}

TEST_F(StartChoiceTest, AMeshWhosePathIsNotUtf8IsRefusedWithTheRemedy) {
  const std::string path = file("caf\xe9.stl");
  EXPECT_EQ(problem_of({.kind = Kind::kMesh, .mesh = path}),
            "the path of the mesh file is not UTF-8; rename the file or its folder");
  EXPECT_EQ(problem_of({.kind = Kind::kMesh, .mesh = file("caf\xc3\xa9.stl")}), "");
}

TEST_F(StartChoiceTest, ASceneOfOneselfIsServedOnThisMachineOnly) {
  const auto arguments = server_arguments({.scene = "wall"}, {});
  EXPECT_TRUE(has(arguments, {"--scene", "wall"}));
  EXPECT_TRUE(has(arguments, {"--insecure"}));
  EXPECT_TRUE(has(arguments, {"--bind", "127.0.0.1"}));
  EXPECT_TRUE(has(arguments, {"--port", "0"}));
  EXPECT_FALSE(has(arguments, {"--begin-with"}));
  EXPECT_TRUE(has(server_arguments({.scene = "crate"}, {}), {"--begin-with", "2"})) << "with its partner";
}

TEST_F(StartChoiceTest, AHostedSceneIsEncryptedAndInvitesTheHostToo) {
  const auto arguments = server_arguments({.scene = "crate", .is_hosted = true, .invited = 2, .port = 5000}, {});
  EXPECT_FALSE(has(arguments, {"--insecure"}));
  EXPECT_FALSE(has(arguments, {"--begin-with"})) << "people take the place of the simulated partner";
  EXPECT_TRUE(has(arguments, {"--bind", "0.0.0.0"}));
  EXPECT_TRUE(has(arguments, {"--port", "5000"}));
  EXPECT_TRUE(has(arguments, {"--invite", "3"}));
}

TEST_F(StartChoiceTest, StructureFilesKeepTheirChainsAndBecomeAbsolute) {
  const std::string pdb = file("a.pdb");
  const auto arguments = server_arguments({.kind = Kind::kDock, .receptor = pdb + ":A,B/478", .ligand = pdb}, {});
  EXPECT_TRUE(has(arguments, {"--receptor", pdb + ":A,B/478"}));
  EXPECT_TRUE(has(arguments, {"--ligand", pdb}));
}

TEST_F(StartChoiceTest, TheSceneOfAMeshHasItsSizeAndAToolAboveIt) {
  const StartChoice choice{.kind = Kind::kMesh, .mesh = file("part.stl"), .mesh_size_m = 0.2, .is_y_up = true};
  const auto scene = boost::json::parse(mesh_scene(choice)).as_object();
  const auto& body = scene.at("bodies").at(0).as_object();
  const auto& mesh = body.at("shapes").at(0).at("mesh");
  EXPECT_EQ(mesh.at("file").as_string(), choice.mesh);
  EXPECT_EQ(mesh.at("largest_size_m").to_number<double>(), 0.2);
  EXPECT_EQ(body.at("placement").at("rotation_xyz_deg").at(0).to_number<double>(), 90);
  EXPECT_FALSE(body.contains("mass_kg"));
  EXPECT_GT(scene.at("tools").at(0).at("placement").at("position_m").at(2).to_number<double>(), 0.1);
  const StartChoice oriented{.kind = Kind::kMesh, .mesh = file("part.glb"), .is_y_up = true, .is_movable = true};
  const auto part = boost::json::parse(mesh_scene(oriented)).as_object().at("bodies").at(0).as_object();
  EXPECT_FALSE(part.contains("placement")) << "the format defines its vertical axis";
  EXPECT_TRUE(part.at("graspable").as_bool());
}

TEST(JoinTarget, FindsAnInvitationWithinPastedText) {
  for (const std::string& pasted : {invitation(), "  " + invitation() + "\r\n",
                                    "invitation (one manipulator, until x): tandem-client --join " + invitation()}) {
    const JoinTarget target = join_target(pasted);
    ASSERT_TRUE(target.invitation) << pasted;
    EXPECT_EQ(target.address, "192.0.2.2:47800");
  }
}

TEST(JoinTarget, IsAnAddressOfThisMachineWithoutAnInvitation) {
  for (const std::string address : {"127.0.0.1:47800", "localhost:5000", "[::1]:5000"}) {
    EXPECT_EQ(join_target(address).address, address);
    EXPECT_FALSE(join_target(address).invitation);
  }
}

TEST(JoinTarget, ExplainsOtherPastedTexts) {
  EXPECT_NE(why_not_joined("").find("paste the invitation"), std::string::npos);
  EXPECT_NE(why_not_joined("192.0.2.2:47800").find("ask its host for an invitation"), std::string::npos);
  EXPECT_NE(why_not_joined(invitation().substr(0, 40)).find("copy all of it"), std::string::npos);
  EXPECT_NE(why_not_joined("localhost:0"), "");
}

}  // namespace
}  // namespace tandem::client

// Writes the seeds for the fuzz targets that read files and assets, with the project's own writers: shipped scenes,
// structures in each format, solid and open meshes, and assets.
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>

#include "common/docking/molecule_asset.hpp"
#include "common/geometry/drawing_asset.hpp"
#include "common/geometry/surface_asset.hpp"
#include "tests/fuzz/seed_file.hpp"

namespace {

using namespace tandem;
namespace fs = std::filesystem;

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

void write_scenes(const fs::path& folder, const fs::path& shipped) {
  for (const auto& entry : fs::directory_iterator(shipped)) {
    if (entry.path().extension() != ".json") continue;
    std::ifstream file(entry.path());
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    fuzz::write_seed(folder / entry.path().stem(), bytes_of(text));
  }
}

void write_structures(const fs::path& folder) {
  const std::string pdb =
      "HEADER    MADE FOR TESTS\n"
      "MODEL        1\n"
      "ATOM      1  N   GLY A   1      11.104   6.134  -6.504  1.00  0.00           N  \n"
      "ATOM      2  CA AGLY A   1      11.639   6.071  -5.147  0.50  0.00           C  \n"
      "ATOM      3  CA BGLY A   1      11.700   6.100  -5.100  0.50  0.00           C  \n"
      "ATOM      4  C   GLY A   1A     13.106   5.700  -5.100  1.00  0.00           C1+\n"
      "TER\n"
      "HETATM    5 ZN    ZN B   2       0.000   0.000   0.000  1.00  0.00          ZN  \n"
      "ENDMDL\n"
      "END\n";
  const std::string mmcif =
      "data_MADE\n#\nloop_\n_atom_site.group_PDB\n_atom_site.id\n_atom_site.type_symbol\n_atom_site.label_atom_id\n"
      "_atom_site.label_alt_id\n_atom_site.label_comp_id\n_atom_site.label_asym_id\n_atom_site.label_seq_id\n"
      "_atom_site.Cartn_x\n_atom_site.Cartn_y\n_atom_site.Cartn_z\n_atom_site.auth_seq_id\n_atom_site.auth_asym_id\n"
      "_atom_site.pdbx_PDB_model_num\n"
      "ATOM 1 N N . GLY A 1 11.104 6.134 -6.504 1 A 1\n"
      "ATOM 2 C \"CA\" A GLY A 1 11.639 6.071 -5.147 1 A 1\n"
      "HETATM 3 ZN 'ZN' ? ZN B . 0.0 0.0 0.0 2 B 1\n"
      "#\n_entry.title\n;a text\nof two lines\n;\n";
  const std::string pqr =
      "REMARK made for tests\n"
      "ATOM 1 N NTER 1 11.104 6.134 -6.504 -0.3 1.85\n"
      "ATOM 2 CA GLY A 1 11.639 6.071 -5.147 0.13 2.27\n"
      "HETATM 3 ZN ZN B 2 0.0 0.0 0.0 2.0 1.39\nEND\n";
  const std::string pdbqt =
      "ROOT\n"
      "ATOM      1  OE1 LIG B   1       0.236  17.885   9.478  0.00  0.00    -0.347 OA\n"
      "ENDROOT\nTORSDOF 0\n";
  fuzz::write_seed(folder / "pdbqt", bytes_of(std::string(1, '\3') + pdbqt));
  fuzz::write_seed(folder / "pdb", bytes_of(std::string(1, '\0') + pdb));
  fuzz::write_seed(folder / "mmcif", bytes_of(std::string(1, '\1') + mmcif));
  fuzz::write_seed(folder / "pqr", bytes_of(std::string(1, '\2') + pqr));
}

/// Writes a mesh in the input format of mesh_fuzz. The unit of length is 2^-10 m.
void write_mesh(const fs::path& file, const std::vector<std::array<int, 3>>& vertices,
                const std::vector<std::array<int, 3>>& triangles) {
  std::string text{static_cast<char>(-10), static_cast<char>(vertices.size())};
  for (const auto* numbers : {&vertices, &triangles}) {
    for (const auto& three : *numbers)
      for (const int number : three) text += static_cast<char>(number);
  }
  fuzz::write_seed(file, bytes_of(text));
}

void write_meshes(const fs::path& folder) {
  const std::vector<std::array<int, 3>> cube{{-9, -9, -9}, {9, -9, -9}, {9, 9, -9}, {-9, 9, -9},
                                             {-9, -9, 9},  {9, -9, 9},  {9, 9, 9},  {-9, 9, 9}};
  const std::vector<std::array<int, 3>> faces{{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                                              {1, 2, 6}, {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};
  write_mesh(folder / "cube", cube, faces);
  write_mesh(folder / "open_cube", cube, {faces.begin(), faces.end() - 2});
  std::vector<std::array<int, 3>> flipped = faces;
  for (std::size_t i = 0; i < flipped.size(); i += 2) std::swap(flipped[i][0], flipped[i][1]);
  write_mesh(folder / "flipped", cube, flipped);
  std::vector<std::array<int, 3>> twice = faces;
  twice.insert(twice.end(), faces.begin(), faces.end());
  write_mesh(folder / "twice", cube, twice);
  write_mesh(folder / "sheet", {{0, 0, 0}, {20, 0, 0}, {0, 20, 0}, {20, 20, 1}}, {{0, 1, 2}, {2, 1, 3}});
  write_mesh(folder / "fin", {{0, 0, 0}, {20, 0, 0}, {0, 20, 0}, {0, 0, 20}, {0, -20, 0}},
             {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}});
}

void write_assets(const fs::path& folder) {
  const auto write = [&folder](const char* name, char kind, const std::vector<std::byte>& asset) {
    std::vector<std::byte> bytes{static_cast<std::byte>(kind)};
    bytes.insert(bytes.end(), asset.begin(), asset.end());
    fuzz::write_seed(folder / name, bytes);
  };
  const geometry::TriangleMesh tetrahedron{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                           {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
  write("surface", 0, geometry::surface_asset_bytes(tetrahedron));
  write("drawing", 2, geometry::drawing_asset_bytes(geometry::shaded(tetrahedron)));
  docking::Molecule molecule;
  for (int i = 0; i < 3; ++i) {
    molecule.positions_angstrom.emplace_back(3.0 * i, 0, 1);
    molecule.sigma_angstrom.push_back(3.2);
    molecule.epsilon_kj_per_mol.push_back(0.7);
    molecule.charge_e.push_back(0.1 * i);
    molecule.mass_u.push_back(12);
  }
  write("molecule", 1, docking::molecule_asset_bytes(molecule));
  molecule.mixes_arithmetically = true;
  molecule.atom_names = {"N", "CA", "ZN"};
  molecule.elements = {"N", "C", "ZN"};
  molecule.residue_names = {"GLY", "GLY", "ZN"};
  molecule.residue_ids = {"7", "7", "301"};
  molecule.chains = {"A", "A", ""};
  molecule.segments = {0, 0, 1};
  write("arithmetic_molecule", 1, docking::molecule_asset_bytes(molecule));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: " << argv[0] << " FOLDER SCENES\n";
    return 2;
  }
  const fs::path folder(argv[1]);
  write_scenes(folder / "scenes", argv[2]);
  write_structures(folder / "structures");
  write_meshes(folder / "meshes");
  write_assets(folder / "assets");
  return 0;
}

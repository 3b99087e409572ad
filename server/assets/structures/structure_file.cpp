// See structure_file.hpp.
#include "server/assets/structures/structure_file.hpp"

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <system_error>

#include "server/assets/structures/readers/mmcif_reader.hpp"
#include "server/assets/structures/readers/pdb_reader.hpp"
#include "server/assets/structures/readers/pqr_reader.hpp"
#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxBytes = std::size_t{256} << 20;
constexpr std::size_t kChunkBytes = std::size_t{1} << 20;

/// Reads a file with zlib, which reads uncompressed files as well.
std::string text_of(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) {
    throw docking::MoleculeError(path.string() +
                                 ": no such file; give the path of a structure in PDB, mmCIF or PQR format");
  }
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(path.c_str(), "rb"), gzclose);
  if (file == nullptr) throw docking::MoleculeError(path.string() + ": cannot be read; check its permissions");
  std::string text;
  while (true) {
    const std::size_t begin = text.size();
    text.resize(begin + kChunkBytes);
    const int count = gzread(file.get(), text.data() + begin, static_cast<unsigned>(kChunkBytes));
    int state = Z_OK;
    if (count <= 0) gzerror(file.get(), &state);
    if (state != Z_OK) throw docking::MoleculeError(path.string() + ": damaged gzip data; fetch the file again");
    text.resize(begin + static_cast<std::size_t>(std::max(count, 0)));
    if (count <= 0) return text;
    if (text.size() > kMaxBytes) {
      throw docking::MoleculeError(path.string() + ": larger than 256 MiB; keep only the chains that are needed");
    }
  }
}

/// Returns whether the first line that is not a comment begins with "data_", as every mmCIF file does.
bool is_mmcif(std::string_view text) {
  while (!text.empty()) {
    const std::string_view line = trimmed(pop_line(text));
    if (!line.empty() && line.front() != '#') return begins_with_any_case(line, "data_");
  }
  return false;
}

/// Returns the extension without ".gz", e.g. ".pqr" for "x.pqr.gz".
std::string format_ending(fs::path path) {
  if (path.extension() == ".gz") path.replace_extension();
  return path.extension().string();
}

}  // namespace

PdbStructure read_structure(const fs::path& path) {
  const std::string text = text_of(path);
  if (text.starts_with("BZh") || text.starts_with("PK") ||
      text.starts_with("\xFD"
                       "7zXZ")) {
    throw docking::MoleculeError(path.string() + ": compressed, not by gzip; unpack it first");
  }
  if (is_mmcif(text)) return parse_mmcif(text, path.string());
  const std::string ending = format_ending(path);
  if (ending == ".pqr") return parse_pqr(text, path.string());
  return parse_pdb(text, path.string(), ending == ".pdbqt" ? PdbFlavour::kPdbqt : PdbFlavour::kPdb);
}

bool StructureSelection::takes_chain(std::string_view chain) const {
  return entries.empty() || std::find(entries.begin(), entries.end(), chain) != entries.end();
}

bool StructureSelection::takes_residue(const PdbResidue& residue) const {
  return std::any_of(entries.begin(), entries.end(), [&residue](const std::string& entry) {
    const std::size_t slash = entry.find('/');
    if (slash == std::string::npos) return false;
    const std::string name = entry.substr(slash + 1);
    return (name == "*" || name == residue.name) && (slash == 0 || entry.substr(0, slash) == residue.chain);
  });
}

StructureChoice structure_choice(const std::string& text) {
  StructureChoice choice;
  const std::size_t colon = text.rfind(':');
  std::error_code error;
  if (colon == std::string::npos || colon + 1 == text.size() || fs::exists(text, error)) return {text, {}};
  choice.file = text.substr(0, colon);
  for (std::size_t begin = colon + 1; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    if (end > begin) choice.selection.entries.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return choice;
}

}  // namespace tandem::server

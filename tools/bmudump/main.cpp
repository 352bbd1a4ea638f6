// bmudump: shows frames as candump does, and says what they mean on the battery's buses.
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "protocol/dbc.hpp"
#include "tools/bmudump/dump.hpp"
#include "tools/bmudump/protocol_doc.hpp"

namespace {

using namespace bmu::dump;

int print_all(const std::string& text) {
  const bool is_written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0;
  if (is_written || errno == EPIPE) return exit_ok;
  std::fprintf(stderr, "bmudump: cannot write: %s\n", std::strerror(errno));
  return exit_system;
}

int run(const Options& options) {
  const DumpCatalogue catalogue(options.catalogue);
  if (!catalogue.ids_unique()) {
    std::fputs("bmudump: --vehicle-base: there the vehicle messages would collide with those of the internal bus\n",
               stderr);
    return exit_usage;
  }
  Filter filter;
  std::string complaint;
  if (!filter.add(options.filter, catalogue.all(), complaint)) {
    std::fprintf(
        stderr,
        "bmudump: --filter: '%s' is neither a hexadecimal identifier nor a message; bmudump --protocol-doc lists "
        "them\n",
        complaint.c_str());
    return exit_usage;
  }
  catch_stop_signals();
  if (options.wants_protocol_doc) return print_all(protocol_doc(catalogue));
  if (!options.dbc.empty()) {
    return print_all(
        bmu::dbc_text(options.dbc == "internal" ? catalogue.internal() : catalogue.vehicle(), options.nodes));
  }
  Dump dump(options, catalogue, filter);
  return dump.finish(options.files.empty() ? dump_live(options, dump) : dump_files(options, dump));
}

}  // namespace

int main(int argc, char** argv) {
  const ParsedOptions parsed = parse_options(argc, argv);
  return parsed.options ? run(*parsed.options) : parsed.exit_code;
}

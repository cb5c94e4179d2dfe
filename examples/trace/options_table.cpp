#include "options_table.h"

#include <algorithm>
#include <cstdio>

namespace trace {

namespace {

class Options {
 public:
  explicit Options(const TableWishes& wishes) : wishes_(wishes) {
    usual_.threads = wishes.threads.front();
    usual_.turns = wishes.turns;
    usual_.contacts = wishes.contacts;
  }

  std::vector<TableRow> all() {
    addThreads("as traced", Work::pairs);
    add("pairs of static geoms skipped", [](Setting& setting) { setting.skip_static = true; });
    add("pairs asleep skipped", [](Setting& setting) { setting.skip_asleep = true; });
    add("planes culled", [](Setting& setting) { setting.cull_planes = true; });
    for (const double tolerance : wishes_.tolerances) {
      char name[64];
      std::snprintf(name, sizeof name, "tolerance %g", tolerance);
      add(name, [&](Setting& setting) { setting.tolerance = tolerance; });
    }
    for (const int devices : wishes_.devices)
      add(std::to_string(devices) + " GPUs", [&](Setting& setting) {
        setting.devices = devices;
        setting.threads = wishes_.threads.back();
      });
    for (const std::string& space : wishes_.spaces)
      add("ODE's " + space + " space", [&](Setting& setting) { setting.space = space; });
    if (wishes_.contacts > 0) {
      add("dCollide in the callback", [](Setting& setting) { setting.work = Work::loop; });
      addThreads("parallel contacts", Work::contacts);
    }
    return std::move(rows_);
  }

 private:
  template <class Change>
  void add(const std::string& name, Change change) {
    Setting setting = usual_;
    change(setting);
    if (isToBeHad(setting)) rows_.push_back({name, setting, {}});
  }
  void addThreads(const char* name, Work work) {
    for (const int threads : wishes_.threads)
      add(name, [&](Setting& setting) {
        setting.threads = threads;
        setting.work = work;
      });
  }

  const TableWishes& wishes_;
  Setting usual_;
  std::vector<TableRow> rows_;
};

}  // namespace

std::vector<TableRow> measureOptions(const Recording& recording, const TableWishes& wishes) {
  std::vector<TableRow> rows = Options(wishes).all();
  for (TableRow& row : rows) row.timing = measure(recording, row.setting);
  return rows;
}

const TableRow& baseOf(const std::vector<TableRow>& rows, const TableRow& row) {
  const bool collides = row.setting.work != Work::pairs;
  return *std::find_if(rows.begin(), rows.end(), [&](const TableRow& one) {
    return (one.setting.work != Work::pairs) == collides;
  });
}

}  // namespace trace

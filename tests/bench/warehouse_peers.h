// The warehouse of the example, whose boxes are in another library's tree. Contacts, rays and poses
// are still dCollide's, so that all find the same.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "warehouse.h"

namespace bench {

struct WarehousePeer {
  std::string name;
  std::unique_ptr<scene::Warehouse> (*create)(const scene::Plan& plan);
};

// All that were built in: each file adds its own before main().
std::vector<WarehousePeer>& warehousePeers();

template <class Kind>
struct AddWarehouse {
  explicit AddWarehouse(const char* name) {
    warehousePeers().push_back(
        {name, [](const scene::Plan& plan) -> std::unique_ptr<scene::Warehouse> {
           return std::make_unique<Kind>(plan);
         }});
  }
};

}  // namespace bench

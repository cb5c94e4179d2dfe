// The warehouse of the example, whose boxes are in another library's tree. Contacts, rays and poses
// are still dCollide's, so that all find the same.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "warehouse.h"

namespace bench {

using CreateWarehouse = std::unique_ptr<scene::Warehouse> (*)(const scene::Plan& plan);

// All that were built in, by name: each file adds its own before main().
std::map<std::string, CreateWarehouse>& warehousePeers();

template <class Kind>
struct AddWarehouse {
  explicit AddWarehouse(const char* name) {
    warehousePeers()[name] = [](const scene::Plan& plan) -> std::unique_ptr<scene::Warehouse> {
      return std::make_unique<Kind>(plan);
    };
  }
};

}  // namespace bench

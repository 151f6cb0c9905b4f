// Reads a file of HDF5 by jsfive.
//   node read_h5.mjs PACKAGES FILE      PACKAGES: the node_modules of package.json beside this
// Prints an object in JSON: of each dataset by its path its shape, type, filters (numbers of HDF5's register), chunks and
// values.

import { createRequire } from "node:module";
import { readFileSync } from "node:fs";

const [packages, path] = process.argv.slice(2);
const require = createRequire(packages + "/x.js");
const { File, Dataset } = require("jsfive");

const bytes = readFileSync(path);
const file = new File(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength), path);
const datasets = {};
const visit = (group, prefix) => {
  for (const name of group.keys) {
    const one = group.get(name);
    if (one instanceof Dataset) {
      const pipeline = one._dataobjects.filter_pipeline;
      datasets[prefix + name] = {
        shape: one.shape,
        dtype: one.dtype,
        filters: pipeline ? [...pipeline.values()].map((filter) => filter.get("filter_id")) : [],
        chunks: one._dataobjects.chunks ?? null,
        value: one.value,
      };
    } else visit(one, prefix + name + "/");
  }
};
visit(file, "");
const plain = (key, value) => (typeof value === "bigint" ? Number(value) : value);
process.stdout.write(JSON.stringify(datasets, plain));

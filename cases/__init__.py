"""Named scenes (`scenes/*.toml`, `fsi cases` lists them) and what is measured on them."""

"""A log as tables: one for each topic, for whoever reads Parquet or CSV."""

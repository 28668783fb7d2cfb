"""Tables of text and numbers: CSV, Excel and Parquet, read row by row."""

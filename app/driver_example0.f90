!> Example 0 of the paper: a free rigid body, one step of size h, attitude a matrix.
program driver_example0
    use frb_driver_free, only: run_free_body
    implicit none

    call run_free_body(0)

end program driver_example0

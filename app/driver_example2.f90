!> Example 2 of the paper: a free rigid body, one step of size h, attitude a quaternion.
program driver_example2
    use frb_driver_free, only: run_free_body
    implicit none

    call run_free_body(2)

end program driver_example2
